#!/usr/bin/python3
"""config/foxglove.json names topics that the nodelet has and fields of its messages, and lays out the panels that it defines."""
import json
import os
import re
import sys
import unittest

import rosunit

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")


def read(*path):
    with open(os.path.join(ROOT, *path)) as file:
        return file.read()


def values_of(tree, keys):
    """All texts below these keys."""
    if isinstance(tree, list):
        return [value for item in tree for value in values_of(item, keys)]
    if not isinstance(tree, dict):
        return []
    found = [tree[key] for key in keys if isinstance(tree.get(key), str)]
    return found + [value for item in tree.values() for value in values_of(item, keys)]


def panels_in(tree):
    return [tree] if isinstance(tree, str) else panels_in(tree["first"]) + panels_in(tree["second"])


class FoxgloveTest(unittest.TestCase):
    def setUp(self):
        self.layout = json.loads(read("config", "foxglove.json"))
        self.panels = self.layout["configById"]

    def test_panels(self):
        self.assertEqual(sorted(panels_in(self.layout["layout"])), sorted(self.panels))

    def test_topics(self):
        known = set(re.findall(r"`~(\w+)`", read("doc", "topics.md")))
        self.assertIn("debug_image", known)
        named = list(self.panels["3D!map"]["topics"]) + values_of(self.panels, ["imageTopic", "topicPath"])
        named += [value.split(".")[0] for value in values_of(self.panels, ["value"])]
        self.assertGreater(len(named), 10)
        for topic in named:
            self.assertEqual(topic[:9], "/tracker/")
            self.assertIn(topic[9:], known)

    def test_fields(self):
        fields = set(re.findall(r"^[\w\[\]]+ +(\w+)", read("msg", "TrackerStatus.msg"), re.M))
        named = {value.split(".")[1] for value in values_of(self.panels, ["value"])}
        self.assertLessEqual({"matches", "inliers", "state"}, named)
        self.assertLessEqual(named, fields)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "foxglove", FoxgloveTest, sysargs=sys.argv)
