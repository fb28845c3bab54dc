#!/usr/bin/python3
"""Every command in README and doc names programs, options, launch files, arguments and scripts that there are."""
import glob
import os
import re
import shlex
import subprocess
import sys
import unittest
from xml.etree import ElementTree

import rosunit

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
PROGRAMS = os.environ.get("PROGRAMS", "")
PACKAGE = "mono_pose_tracker"


def commands():
    """(document, words) of each line of a code block or code within a line that begins with a command."""
    for path in [os.path.join(ROOT, "README.md"), os.path.join(ROOT, "CONTRIBUTING.md"),
                 *sorted(glob.glob(os.path.join(ROOT, "doc", "*.md")))]:
        with open(path) as file:
            text = file.read().replace("\\\n", " ")
        lines = re.findall(r"^    (\S.*)$", text, re.M) + re.findall(r"`([^`\n]+)`", text)
        for line in lines:
            for part in re.split(r"\s(?:&&|\|)\s", line):
                part = re.sub(r"^(?:[A-Z_]+=\S+\s+)+", "", part.strip().lstrip("$ "))
                if re.match(r"(rosrun|roslaunch|scripts/)\s*\S", part):
                    # FOLDER|LIST is a choice, [--option] may be left out, ... is more of the same.
                    words = shlex.split(re.sub(r"[\[\]]", " ", part).replace("'", ""), comments=True)
                    yield os.path.relpath(path, ROOT), words


def options(words):
    return [word.split("=")[0] for word in words if re.match(r"--?[a-z]", word)]


class DocumentedCommandsTest(unittest.TestCase):
    def setUp(self):
        self.help = {}

    def help_of(self, program):
        if program not in self.help:
            path = os.path.join(PROGRAMS, program)
            if not os.path.exists(path):
                path = os.path.join(ROOT, "scripts", program)
            self.assertTrue(os.path.exists(path), program)
            done = subprocess.run([path, "--help"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120)
            self.help[program] = done.stdout
        return self.help[program]

    def test_programs_have_the_options(self):
        checked = 0
        for document, words in commands():
            if words[:2] != ["rosrun", PACKAGE]:
                continue
            program = words[2]
            if program in ("tracker_node", "camera_node"):  # nodes: they have parameters
                continue
            is_benchmark = os.path.exists(os.path.join(ROOT, "src", "benchmarks", program + ".cpp"))
            if is_benchmark and not os.path.exists(os.path.join(PROGRAMS, program)):
                continue  # needs a library that is not installed (google-benchmark)
            for option in options(words[3:]):
                self.assertRegex(self.help_of(program), rf"(?<![\w-]){re.escape(option)}(?![\w-])", f"{document}: {words}")
                checked += 1
            if not options(words[3:]):
                self.assertTrue(self.help_of(program), f"{document}: {words}")
        self.assertGreater(checked, 30)

    def test_the_packages_own_files_are_where_the_commands_look_for_them(self):
        """A file of the package's config folder by its bare name is not found from where a user stands."""
        own = set(os.listdir(os.path.join(ROOT, "config")))
        checked = 0
        for document, words in commands():
            for word in words:
                name = os.path.basename(word)
                if name in own:
                    self.assertTrue(word.endswith("`/config/" + name), f"{document}: {words}")
                    checked += 1
        self.assertGreater(checked, 3)

    def test_launch_files_have_the_arguments(self):
        checked = 0
        for document, words in commands():
            if words[0] != "roslaunch" or PACKAGE not in words:
                continue
            file = words[words.index(PACKAGE) + 1]
            path = os.path.join(ROOT, "launch", file)
            if file == "FILE":
                continue
            self.assertTrue(os.path.exists(path), f"{document}: {words}")
            known = {arg.get("name") for arg in ElementTree.parse(path).getroot().findall("arg")}
            for word in words[words.index(PACKAGE) + 2:]:
                if ":=" in word:
                    self.assertIn(word.split(":=")[0], known, f"{document}: {words}")
                    checked += 1
        self.assertGreater(checked, 15)

    def test_scripts_are_there(self):
        checked = 0
        for document, words in commands():
            if not words[0].startswith("scripts/"):
                continue
            path = os.path.join(ROOT, words[0])
            if os.path.isdir(path) or "." in words[0]:  # scripts/cmake/x.cmake is a file, not a command
                continue
            self.assertTrue(os.access(path, os.X_OK), f"{document}: {words}")
            with open(path) as file:
                text = file.read()
            for option in options(words[1:]):
                self.assertIn(option, text, f"{document}: {words}")
                checked += 1
        self.assertGreater(checked, 10)

    def test_each_is_run_by_a_test_or_by_scripts_figures(self):
        """Told by names: a file that has the program's has the option's as well."""
        runners = {}
        for path in [*glob.glob(os.path.join(ROOT, "test", "tools", "*.py")), *glob.glob(os.path.join(ROOT, "test", "ros", "*.py")),
                     *glob.glob(os.path.join(ROOT, "test", "ros", "*.test")), os.path.join(ROOT, "scripts", "figures"),
                     os.path.join(ROOT, "scripts", "demo")]:
            if not path.endswith("documented_commands_test.py"):
                with open(path) as file:
                    runners[path] = file.read()

        def is_run(program, option):
            return any(program in text and re.search(rf"(?<![\w-]){re.escape(option)}(?![\w-])", text)
                       for text in runners.values())
        checked = 0
        for document, words in commands():
            if words[:2] == ["rosrun", PACKAGE]:
                program, given = words[2], options(words[3:]) or [""]
            elif words[0] == "roslaunch" and PACKAGE in words:
                file = words[words.index(PACKAGE) + 1]
                program, given = file.replace(".launch", ""), [word.split(":=")[0] for word in words if ":=" in word]
            else:
                continue
            for option in given:
                self.assertTrue(program == "FILE" or is_run(program, option), f"{document}: nothing runs {program} with {option}")
                checked += 1
        self.assertGreater(checked, 100)


if __name__ == "__main__":
    rosunit.unitrun(PACKAGE, "documented_commands", DocumentedCommandsTest, sysargs=sys.argv)
