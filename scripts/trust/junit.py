"""What pytest and ctest write of the tests they have run, in the form of JUnit."""

from xml.etree import ElementTree


def cases(path):
    """The tests of a file; none if there is no file, as of a runner that didn't start."""
    return list(ElementTree.parse(path).iter("testcase")) if path.exists() else []


def outcome(case):
    """passed, skipped or failed.  A program that ctest didn't find, whose status is "notrun", has failed."""
    if case.find("failure") is not None or case.find("error") is not None or case.get("status") in ("fail", "notrun"):
        return "failed"
    return "skipped" if case.find("skipped") is not None or case.get("status") == "disabled" else "passed"


def named(found, word):
    """The tests with this outcome."""
    return [case for case in found if outcome(case) == word]
