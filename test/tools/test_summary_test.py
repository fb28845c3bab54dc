#!/usr/bin/python3
"""What scripts/test says at its end, and which arguments it takes."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import rosunit

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
SUPPORT = SCRIPTS.parent / "test" / "support"


def suite(*cases):
    return "<testsuites><testsuite>" + "".join(cases) + "</testsuite></testsuites>"


def case(name, seconds=0.0, inside=""):
    return f'<testcase classname="Group" name="{name}" time="{seconds}">{inside}</testcase>'


class TestSummary(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def write(self, name, text):
        path = pathlib.Path(self.folder.name) / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)

    def summarise(self, *programs, options=()):
        """Its lines and exit status."""
        done = subprocess.run([sys.executable, SCRIPTS / "summarise_tests", *options, self.folder.name, *programs],
                              stdout=subprocess.PIPE, text=True)
        return done.stdout.splitlines(), done.returncode

    def test_the_last_two_lines(self):
        self.write("pkg/a.xml", suite(case("good"), case("skipped_case", inside='<skipped message="no data"/>')))
        self.write("pkg/b.xml", suite(case("better")))
        lines, status = self.summarise()
        self.assertEqual(lines[-2:], ["skipped: Group.skipped_case", "2 passed, 0 failed"])
        self.assertEqual(status, 0)

    def test_a_program_that_never_ran_has_failed(self):
        self.write("pkg/gtest-test_map.xml", suite(case("good")))
        self.write("pkg/rostest-test_ros_bag_test.xml", suite(case("good")))
        programs = ["gtest_test_map", "rostest_test_ros_bag_test.test", "python_readme_test"]
        self.assertEqual(self.summarise(*programs[:2])[1], 0)
        lines, status = self.summarise(*programs)
        self.assertIn("failed: python_readme_test: left no result", lines)
        self.assertEqual(lines[-1], "1 passed, 1 failed")
        self.assertEqual(status, 1)

    def test_programs_of_the_full_run_are_named(self):
        self.write("gtest-a.xml", suite(case("a")))
        lines, status = self.summarise("gtest_a", options=["--not-run=python_slow_test,rostest_b"])
        self.assertEqual(lines[-2:], ["skipped: python_slow_test (--full runs it), rostest_b (--full runs it)",
                                      "1 passed, 0 failed"])
        self.assertEqual(status, 0)

    def test_skipped_python_tests_are_named(self):
        """rosunit by itself writes them down as passed."""
        test = pathlib.Path(self.folder.name) / "needy.py"
        whole = ('@unittest.skip("needs all of it")', "")
        part = ("", 'self.skipTest("needs some")')
        for name, (decorator, inside) in {"whole": whole, "part": part}.items():
            test.write_text(f"""import sys, unittest, rosunit
sys.path.insert(0, {str(SUPPORT)!r})
import reported_skips
{decorator}
class Needy(unittest.TestCase):
    def test_{name}(self): {inside or "pass"}
class Content(unittest.TestCase):
    def test_{name}(self): pass
for kind in Needy, Content:
    file = "--gtest_output=xml:{self.folder.name}/pkg/{name}_" + kind.__name__ + ".xml"
    rosunit.unitrun("pkg", kind.__name__, kind, [sys.argv[0], file])
""")
            subprocess.run([sys.executable, test], check=True, stdout=subprocess.DEVNULL)
        text = "".join(p.read_text() for p in pathlib.Path(self.folder.name).glob("pkg/*.xml"))
        self.assertIn("needs all of it", text)
        self.assertIn("needs some", text)
        lines, status = self.summarise()
        self.assertEqual(lines[-2:], ["skipped: __main__.Needy.test_part, __main__.Needy.test_whole", "2 passed, 0 failed"])
        self.assertEqual(status, 0)

    def test_what_fails_outside_of_a_test_case_has_failed(self):
        """rosunit counts what setUpClass and subTest find and writes no case of it."""
        broken = ("@classmethod\n    def setUpClass(cls): raise OSError()\n    def test_it(self): pass",
                  "def test_it(self):\n        with self.subTest(): self.fail()")
        for number, inside in enumerate(broken):
            test = pathlib.Path(self.folder.name) / "broken.py"
            test.write_text(f"""import sys, unittest, rosunit
class Broken(unittest.TestCase):
    {inside}
rosunit.unitrun("pkg", "broken", Broken, [sys.argv[0], "--gtest_output=xml:{self.folder.name}/pkg/broken_{number}.xml"])
""")
            subprocess.run([sys.executable, test], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        lines, status = self.summarise()
        for number in range(len(broken)):
            self.assertIn(f"failed: broken_{number}: outside of its test cases", lines)
        self.assertEqual(status, 1)

    def test_a_file_without_a_case_has_failed(self):
        self.write("pkg/a.xml", suite(case("good")))
        self.write("pkg/gtest-filtered.xml", "<testsuites/>")
        self.write("pkg/rosunit-b.xml", '<testsuite tests="0"/>')
        lines, _ = self.summarise()
        self.assertIn("failed: rosunit-b: no test case", lines)
        self.assertEqual(lines[-1], "1 passed, 1 failed")

    def test_failures_are_named(self):
        self.write("pkg/a.xml", suite(case("good"), case("bad", inside='<failure message="x"/>'),
                                      case("worse", inside="<error/>")))
        lines, status = self.summarise()
        self.assertIn("failed: Group.bad", lines)
        self.assertIn("failed: Group.worse", lines)
        self.assertEqual(lines[-2:], ["skipped: none", "1 passed, 2 failed"])
        self.assertEqual(status, 1)

    def test_what_cannot_be_read_has_failed(self):
        self.write("pkg/a.xml", suite(case("good")))
        self.write("pkg/gtest-cut.xml", "<testsuites><testsui")
        lines, status = self.summarise()
        self.assertIn("failed: gtest-cut", lines)
        self.assertEqual((lines[-1], status), ("1 passed, 1 failed", 1))

    def test_nothing_at_all_is_a_failure(self):
        lines, status = self.summarise()
        self.assertEqual((lines[-1], status), ("0 passed, 0 failed", 1))

    def test_rostests_are_counted_once(self):
        self.write("pkg/rostest-a.xml", suite(case("good")))
        self.write("pkg/rosunit-a.xml", suite(case("good")))
        self.assertEqual(self.summarise()[0][-1], "1 passed, 0 failed")

    def test_what_a_rostest_found_counts_though_rostest_is_content(self):
        self.write("pkg/rostest-a.xml", suite(case("ran")))
        self.write("pkg/rosunit-a.xml", suite(case("good"), case("bad", inside='<failure message="x"/>')))
        lines, status = self.summarise()
        self.assertIn("failed: Group.bad", lines)
        self.assertEqual((lines[-1], status), ("1 passed, 1 failed", 1))

    def test_a_rostest_whose_node_died_has_failed(self):
        self.write("pkg/rostest-a.xml", suite(case("no_results", inside='<failure message="did not generate"/>')))
        self.assertEqual(self.summarise()[0][-1], "0 passed, 1 failed")

    def test_the_ten_slowest_are_listed(self):
        self.write("pkg/a.xml", suite(*[case(f"of_{i}_s", i) for i in range(30)]))
        lines, _ = self.summarise()
        slowest = [line.split()[-1] for line in lines if line.strip().startswith(tuple("0123456789")) and " s " in line]
        self.assertEqual(slowest, [f"Group.of_{i}_s" for i in range(29, 19, -1)])

    def test_a_sanitizers_report_is_a_failure(self):
        self.write("pkg/a.xml", suite(case("good")))
        self.write("sanitizer_reports/report.7", "=====\nWARNING: ThreadSanitizer: data race (pid=7)\n  Write of size 8\n")
        lines, status = self.summarise()
        self.assertTrue([line for line in lines if line.startswith("failed: ") and "data race" in line], lines)
        self.assertEqual((lines[-1], status), ("1 passed, 1 failed", 1))

    def test_unknown_arguments_are_refused(self):
        for arguments in (["--nonsense"], ["--sanitize=memory"], ["--fuzz=soon"], ["tests"]):
            done = subprocess.run([SCRIPTS / "test", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                  env={**os.environ, "MONO_POSE_TRACKER_BUILD": self.folder.name})
            self.assertEqual(done.returncode, 2, arguments)
            self.assertIn(arguments[0], done.stderr)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "test_summary", TestSummary, sysargs=sys.argv)
