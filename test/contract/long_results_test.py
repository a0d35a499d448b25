"""What `make test-long` writes: the page of the results of pytest and ctest, and the one that is checked in."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts" / "trust"))
from long_results import page

RESULTS = """<testsuites><testsuite>
<testcase classname="test.algebra.a_test" name="test_one" time="1.5"><properties><property name="worst_u" value="2.5"/></properties></testcase>
<testcase classname="test.algebra.a_test" name="test_two[x]" time="2"><properties><property name="worst_u" value="0.5"/></properties>
<failure message="no"/></testcase>
<testcase classname="test.algebra.b_test" name="test_three" time="0"><properties><property name="worst" value="0.25"/></properties></testcase>
<testcase classname="test.algebra.b_test" name="test_four" time="0"><skipped/></testcase>
</testsuite></testsuites>"""


CTEST = """<testsuite><testcase name="load" classname="load" time="1" status="run"/>
<testcase name="engine_test" classname="engine_test" time="1" status="fail"><failure message=""/></testcase></testsuite>"""


def test_the_page_has_the_results(tmp_path):
    of_pytest, of_ctest = tmp_path / "long_pytest.xml", tmp_path / "long_gcc-x86-64-v2.xml"
    of_pytest.write_text(RESULTS), of_ctest.write_text(CTEST)
    text = page(of_pytest, [of_ctest])
    assert "| gcc-x86-64-v2 | 1 | engine_test |\n" in text
    assert "* passed: 2, failed: 1, skipped: 1\n* time of the tests, one after the other: 4 s\n" in text
    assert "| test/algebra/a_test.py | 2 | 2.5 |  |\n| test/algebra/b_test.py | 2 |  | 0.25 |\n" in text
    assert text.endswith("Failed:\n\n* `test.algebra.a_test::test_two[x]`\n")


def test_the_last_run_passed():
    text = (ROOT / "test" / "long_results.md").read_text(encoding="utf-8")
    assert re.search(r"^\* date: \d{4}-\d\d-\d\d \d\d:\d\d UTC$", text, re.MULTILINE)
    assert re.search(r"^\* commit: [0-9a-f]{40}$", text, re.MULTILINE), "of a commit, and of nothing that was not committed"
    assert re.search(r"^\* passed: [1-9]\d*, failed: 0, skipped: 0$", text, re.MULTILINE)
    builds = re.findall(r"^\| ((?:gcc|clang)-x86-64-v[234]) \| (\d+) \| (.*) \|$", text, re.MULTILINE)
    assert len(builds) == 6 and all(int(passed) > 9 and not failed for _, passed, failed in builds)
