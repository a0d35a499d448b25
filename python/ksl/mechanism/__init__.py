"""Mechanisms: joints, links, states and requests, and the calls of all algorithms."""
