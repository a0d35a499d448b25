"""Readers of files of motions, a file for each format; `recognise` tells the format from the content."""
