#!/usr/bin/python3
"""What scripts/play_bag says at a bag's end of what became of the images."""
import collections
import importlib.machinery
import importlib.util
import os
import sys
import types
import unittest

import rosunit

sys.dont_write_bytecode = True  # nothing beside the script
SCRIPT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "scripts", "play_bag")
loader = importlib.machinery.SourceFileLoader("play_bag", SCRIPT)
play_bag = importlib.util.module_from_spec(importlib.util.spec_from_loader("play_bag", loader))
loader.exec_module(play_bag)


def summary(received, posed, dropped, reasons=()):
    answers = object.__new__(play_bag.Answers)  # nobody to listen to
    answers.lost, answers.reasons = 0, collections.Counter(reasons)
    answers.last = types.SimpleNamespace(frames_received=received, frames_posed=posed, frames_dropped=dropped,
                                         epoch=0, keyframes=5, landmarks=100)
    return answers.summary([])


class SummaryTest(unittest.TestCase):
    def test_what_goes_well_is_one_line(self):
        said = summary(400, 385, 3)
        self.assertIn("400 images: 385 posed, 3 dropped", said)
        self.assertNotIn("\n", said)

    def test_many_dropped_are_told_what_helps(self):
        said = summary(120, 53, 30)
        self.assertIn("rate:=0.5", said)
        self.assertIn("track_sequence", said)

    def test_none_posed_says_the_usual_reason(self):
        self.assertIn("LOW_PARALLAX", summary(60, 0, 2, ["LOW_PARALLAX: hardly moved"] * 3))


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "play_bag", SummaryTest, sysargs=sys.argv)
