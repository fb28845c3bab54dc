#!/usr/bin/python3
"""README and doc explain every reason, state, finding, parameter, launch argument, option and key of a JSON file that there is,
and no other reason. They keep to their sizes, and name only files that there are."""
import glob
import os
import re
import subprocess
import sys
import unittest
from xml.etree import ElementTree

import rosunit

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")


def read(*path):
    with open(os.path.join(ROOT, *path)) as file:
        return file.read()


def documents():
    """The texts of the README and of what is beside it in doc."""
    return [read("README.md")] + [read(path) for path in sorted(glob.glob(os.path.join(ROOT, "doc", "*.md")))]


def section(title):
    found = [m.group(1) for text in documents() for m in re.finditer(rf"^## {title}\n(.*?)(?=^## |\Z)", text, re.M | re.S)]
    assert len(found) == 1, f"{title}: in {len(found)} documents"
    return found[0]


def headings(text):
    """The anchors of a document, as they are made of its headings."""
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in re.findall(r"^#+ (.+)$", text, re.M)}


class ReadmeTest(unittest.TestCase):
    def test_every_reason_is_explained(self):
        codes = set(re.findall(r'case Reason::\w+:\s*return "(\w+)"', read("src", "common", "status.cpp")))
        self.assertIn("LOW_PARALLAX", codes)
        rows = re.findall(r"^\| `([A-Z_]+)` \| (.+?) \| (.*?) ?\|$", section("States and reasons"), re.M)
        self.assertEqual({code for code, _, _ in rows}, codes)
        for code, meaning, advice in rows:
            self.assertTrue(meaning.strip(), code)
            self.assertTrue(advice.strip(), code)

    def test_the_message_has_the_same_reasons(self):
        codes = re.findall(r'case Reason::\w+:\s*return "(\w+)"', read("src", "common", "status.cpp"))
        states = re.findall(r'case State::\w+:\s*return "(\w+)"', read("src", "common", "status.cpp"))
        # Constants of one message share a name space: the reason PAUSED has the state of that name beside it.
        names = ["REASON_" + code if code in states else code for code in codes]
        message = read("msg", "TrackerStatus.msg")
        of_reason = message[message.index("uint8 state\n"):message.index("uint8 reason\n")]
        self.assertEqual(re.findall(r"^uint8 (\w+) = (\d+)", of_reason, re.M),
                         [(name, str(number)) for number, name in enumerate(names)])

    def test_every_state_is_explained(self):
        for state in re.findall(r'case State::\w+:\s*return "(\w+)"', read("src", "common", "status.cpp")):
            self.assertRegex(section("States and reasons"), rf"(?m)^\| `{state}` \| .+ \|$")

    def test_every_launch_argument_is_in_its_section(self):
        sections = [s for text in documents() for s in re.split(r"(?m)^(?=## )", text)]
        for path in sorted(glob.glob(os.path.join(ROOT, "launch", "*.launch"))):
            file = os.path.basename(path)
            told = "".join(s for s in sections if file in s)
            for arg in ElementTree.parse(path).getroot().findall("arg"):
                self.assertIn("`" + arg.get("name") + "`", told, file)

    def test_every_link_leads_somewhere(self):
        paths = ["README.md", "CONTRIBUTING.md"] + sorted(glob.glob(os.path.join(ROOT, "doc", "*.md")))
        checked = 0
        for path in paths:
            folder = os.path.dirname(os.path.join(ROOT, path))
            for link in re.findall(r"\]\(([^)\s]+)\)", read(path)):
                if link.startswith("http"):
                    continue
                file, _, anchor = link.partition("#")
                target = os.path.join(folder, file) if file else os.path.join(ROOT, path)
                self.assertTrue(os.path.exists(target), f"{path}: {link}")
                if anchor:
                    self.assertIn(anchor, headings(read(target)), f"{path}: {link}")
                checked += 1
        self.assertGreater(checked, 20)

    def test_the_pages_keep_to_their_sizes(self):
        def size(path):
            return os.path.getsize(os.path.join(ROOT, path))
        pages = glob.glob(os.path.join(ROOT, "doc", "*.md"))
        self.assertLessEqual(size("README.md"), 16000)
        self.assertLessEqual(size("CONTRIBUTING.md"), 6000)
        self.assertLessEqual(sum(size(page) for page in pages), 90000)
        self.assertEqual([page for page in pages if size(page) > 10000], [])
        unreleased = read("CHANGELOG.rst").partition("Forthcoming\n")[2].split("\n\n")[0]
        self.assertLessEqual(unreleased.count("\n"), 26, "25 lines below the underline")

    def test_every_page_is_in_the_index(self):
        index = read("doc", "README.md")
        pages = {os.path.basename(path) for path in glob.glob(os.path.join(ROOT, "doc", "*.md"))} - {"README.md"}
        self.assertEqual(sorted(page for page in pages if f"({page})" not in index), [])

    def test_every_picture_is_shown(self):
        shown = "".join(documents())
        pictures = {os.path.basename(path) for path in glob.glob(os.path.join(ROOT, "doc", "*")) if not path.endswith(".md")}
        self.assertEqual(sorted(picture for picture in pictures if picture not in shown), [])

    def test_files_that_are_named_are_there(self):
        """Of the repository, in documents; and pages of doc in messages, comments, launch files and scripts."""
        checked = 0
        for path in ["README.md", "CONTRIBUTING.md"] + sorted(glob.glob(os.path.join(ROOT, "doc", "*.md"))):
            for name in re.findall(r"`((?:src|scripts|test|config|launch|include|msg|doc|\.ci)/[\w./-]+\.\w+)`", read(path)):
                self.assertTrue(os.path.exists(os.path.join(ROOT, name)), f"{path}: {name}")
                checked += 1
        self.assertGreater(checked, 20)
        for folder in ("config", "include", "launch", "msg", "scripts", "src", "test"):
            for path in glob.glob(os.path.join(ROOT, folder, "**"), recursive=True):
                if not os.path.isfile(path) or "/corpus/" in path or "/data/" in path:
                    continue
                with open(path, errors="replace") as file:
                    for name in re.findall(r"\bdoc/\w+\.(?:md|svg|png|jpg)\b", file.read()):
                        self.assertTrue(os.path.exists(os.path.join(ROOT, name)), f"{path}: {name}")

    def test_the_diagram_is_of_the_folders_as_they_are(self):
        done = subprocess.run([os.path.join(ROOT, "scripts", "draw_architecture"), "--check"], stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_every_finding_is_explained(self):
        names = re.search(r"kNames = {(.*?)}", read("src", "quality", "quality_report.cpp"), re.S)[1]
        kinds = set(re.findall(r'"([a-z_]+)"', names))
        self.assertIn("inconsistent_segment", kinds)
        self.assertEqual(set(re.findall(r"^\| `(\w+)` \|", section("Findings"), re.M)), kinds)

    def test_every_key_of_report_json_is_named(self):
        self.expect_keys("report.md", {"tracked", "weakest_seam_points", "focal_length_sigma", "camera", "p95_ms"},
                         ("results", "report.cpp"), ("json.h",))

    def test_every_key_of_evaluate_trajectory_is_named(self):
        self.expect_keys("evaluation.md", {"frames_matched", "epochs", "problem", "rpe_delta"}, ("evaluate_trajectory.cpp",))

    def test_every_option_of_a_program_is_named(self):
        text = "".join(documents())
        found = set()
        for path in sorted(glob.glob(os.path.join(ROOT, "src", "tools", "*.*")) +
                           glob.glob(os.path.join(ROOT, "src", "benchmarks", "*.*"))):
            with open(path) as file:
                declared = re.findall(r'add_(?:option|flag)\(\s*"(--[a-z-]+)"', file.read())
            missing = [option for option in declared if not re.search(rf"(?<![\w-]){option}(?![\w-])", text)]
            self.assertEqual(missing, [], os.path.basename(path))
            found |= set(declared)
        self.assertLessEqual({"--images", "--align", "--bag-masks", "--alpha", "--quality", "--repeat"}, found)

    def expect_keys(self, document, some, *sources):
        """Each key that these sources write stands in a row of a table of the document; `some` of them are known."""
        keys = set()
        for source in sources:
            # {"key", value} in an initialiser, json["key"] = value.
            keys |= set(re.findall(r'\{"(\w+)",|\w\["(\w+)"\] =', read("src", "tools", *source)))
        keys = {key for pair in keys for key in pair if key}
        self.assertLessEqual(some, keys, "every way to write one is seen")
        rows = "".join(re.findall(r"^\|.*\|$", read("doc", document), re.M))
        self.assertEqual(sorted(key for key in keys if f"`{key}`" not in rows), [], "in doc/" + document)

    def test_every_parameter_is_named(self):
        text = "".join(documents())
        found = set()
        for path in glob.glob(os.path.join(ROOT, "src", "ros", "*.cpp")):
            with open(path) as file:
                for key in re.findall(r'reader\.read\(\{?\s*"([\w/]+)"', file.read()):
                    self.assertRegex(text, f"`~?{key}`", path)
                    found.add(key)
        self.assertLessEqual({"map_path", "map_orientation"}, found, "both ways to read one are seen")


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "readme", ReadmeTest, sysargs=sys.argv)
