#!/usr/bin/python3
"""What scripts/play_bag says at a bag's end of what became of the images."""
import collections
import contextlib
import importlib.machinery
import importlib.util
import io
import os
import sys
import tempfile
import types
import unittest

import rosbag
import rospy
import rosunit
from sensor_msgs.msg import CameraInfo, Image

sys.dont_write_bytecode = True  # nothing beside the script
SCRIPT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "scripts", "play_bag")
loader = importlib.machinery.SourceFileLoader("play_bag", SCRIPT)
play_bag = importlib.util.module_from_spec(importlib.util.spec_from_loader("play_bag", loader))
loader.exec_module(play_bag)


def summary(received, registered, dropped, reasons=(), stale=0):
    answers = object.__new__(play_bag.Answers)  # nobody to listen to
    answers.lost, answers.stale, answers.reasons = 0, stale, collections.Counter(reasons)
    answers.last = types.SimpleNamespace(frames_received=received, frames_posed=registered, frames_dropped=dropped,
                                         epoch=0, keyframes=5, landmarks=100)
    return answers.summary([])


class SummaryTest(unittest.TestCase):
    def test_what_goes_well_is_one_line(self):
        said = summary(400, 385, 3)
        self.assertIn("400 images: 385 registered, 3 dropped", said)
        self.assertNotIn("\n", said)

    def test_many_dropped_are_told_what_helps(self):
        said = summary(120, 53, 30)
        self.assertIn("rate:=0.5", said)
        self.assertIn("track_sequence", said)

    def test_stamps_that_do_not_increase_are_no_fault_of_the_machine(self):
        said = summary(24, 4, 12, stale=12)
        self.assertIn("12 images are dropped because their stamps are not newer", said)
        self.assertNotIn("too slow", said)
        self.assertIn("too slow", summary(24, 4, 16, stale=4))

    def test_none_registered_names_the_usual_reason(self):
        self.assertIn("LOW_PARALLAX", summary(60, 0, 2, ["LOW_PARALLAX: hardly moved"] * 3))


class BagsTest(unittest.TestCase):
    def setUp(self):
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        self.folder = made.name

    def file(self, name, content=b""):
        path = os.path.join(self.folder, name)
        with open(path, "wb") as file:
            file.write(content)
        return path

    def bag(self, name, topics, begin=1):
        path = os.path.join(self.folder, name)
        with rosbag.Bag(path, "w") as bag:
            for topic, message in topics:
                bag.write(topic, message, rospy.Time(begin))
        return path

    def refusal(self, function, *arguments):
        """The line that it ends with."""
        said = io.StringIO()
        with contextlib.redirect_stderr(said), self.assertRaises(SystemExit):
            function(*arguments)
        self.assertEqual(said.getvalue().count("\n"), 1, said.getvalue())
        return said.getvalue()

    def test_one_bag_several_and_a_pattern(self):
        spaced, first, second = self.file("my bag.bag"), self.file("split_0.bag"), self.file("split_1.bag")
        self.assertEqual(play_bag.bags_of(spaced), [spaced])
        self.assertEqual(play_bag.bags_of(f"{second} {first}"), [second, first])
        self.assertEqual(play_bag.bags_of(self.folder + "/split_*.bag"), [first, second])
        self.assertEqual(play_bag.bags_of("/none.bag"), ["/none.bag"])

    def test_topics_are_of_all_bags(self):
        bags = [self.bag("a.bag", [("/image", Image())]), self.bag("b.bag", [("/camera_info", CameraInfo())])]
        self.assertEqual(set(play_bag.read_topics(bags)), {"/image", "/camera_info"})

    def test_what_is_no_bag_is_named_in_one_line(self):
        for name, content, word in (("a.mcap", b"\x89MCAP0\r\n" + bytes(100), "MCAP"),
                                    ("a.db3", b"SQLite format 3\0" + bytes(100), "ROS 2"),
                                    ("a.mp4", b"\0\0\0\x20ftypisom" + bytes(100), "video"),
                                    ("a.ts", b"G@" + bytes(100), "video"), ("a.txt", b"hello", "is not a bag: expected"),
                                    ("a.bag", b"", "is empty: expected"), ("b.bag", bytes(range(256)) * 10, "is not a bag"),
                                    ("c.bag", b"#ROSBAG V3.0\n" + bytes(100), "cannot be read as a bag")):
            path = self.file(name, content)
            said = self.refusal(play_bag.read_topics, [path])
            self.assertIn(path, said)
            self.assertIn(word, said)
        self.file("metadata.yaml")
        self.assertIn("ROS 2", self.refusal(play_bag.read_topics, [self.folder]))
        whole = self.bag("whole.bag", [("/image", Image())])
        with open(whole, "rb") as file:
            cut = self.file("cut.bag", file.read()[:-100])
        self.assertIn("copied in part): `rosbag reindex`", self.refusal(play_bag.read_topics, [cut]))

    def test_the_type_of_the_messages_decides_not_the_name(self):
        topics = {"/cam/image_raw": play_bag.PACKED, "/axis/compressed": play_bag.PACKED, "/raw": play_bag.RAW,
                  "/both": play_bag.RAW, "/both/compressed": play_bag.PACKED, "/info": "sensor_msgs/CameraInfo"}

        def chosen(wanted, transport="auto"):
            return play_bag.choose_image_topic("a.bag", topics, wanted, transport)
        self.assertEqual(chosen("/cam/image_raw"), ("/cam/image_raw", "compressed"))
        self.assertEqual(chosen("/cam/image_raw", "compressed"), ("/cam/image_raw", "compressed"))
        self.assertEqual(chosen("/axis"), ("/axis/compressed", "compressed"))
        self.assertEqual(chosen("/axis/compressed"), ("/axis/compressed", "compressed"))
        self.assertEqual(chosen("/both"), ("/both", "raw"))
        self.assertEqual(chosen("/both", "compressed"), ("/both/compressed", "compressed"))
        self.assertIn("compressed images", self.refusal(chosen, "/cam/image_raw", "raw"))
        self.assertIn("sensor_msgs/CameraInfo", self.refusal(chosen, "/info"))
        self.assertIn("/axis/compressed, /both", self.refusal(chosen, "/none"))
        topics = {"/depth/compressedDepth": play_bag.PACKED}
        self.assertIn("it has none", self.refusal(chosen, "/depth"))

    def test_the_chosen_transport_is_named(self):
        self.assertEqual(play_bag.transport_note("/axis", "/axis/compressed", "compressed"),
                         "the bag has no /axis but /axis/compressed: image_transport:=compressed")
        for image in ("/axis/compressed", "axis/compressed"):
            self.assertEqual(play_bag.transport_note("/axis/compressed", image, "compressed"),
                             f"{image} holds compressed images: image_transport:=compressed")

    def test_a_calibration_on_another_topic_is_used_next_to_the_images_and_named_elsewhere(self):
        topics = {"/axis/compressed": play_bag.PACKED, "/axis/camera_info": play_bag.INFO, "/b/camera_info": play_bag.INFO}
        wanted = "/camera_info"
        note = f"the bag has no camera_info on {wanted}, but on /axis/camera_info, /b/camera_info: "
        self.assertEqual(play_bag.find_calibration(topics, wanted, "/axis/compressed"),
                         ("/axis/camera_info", note + "/axis/camera_info is used"))
        self.assertEqual(play_bag.find_calibration(topics, wanted, "/c/image_raw"),
                         (None, note + "choose with camera_info_topic:="))
        self.assertEqual(play_bag.find_calibration(topics, "/b/camera_info", "/axis/compressed"), ("/b/camera_info", ""))
        self.assertEqual(play_bag.find_calibration({"/axis/compressed": play_bag.PACKED}, wanted, "/axis/compressed"),
                         (None, ""))
        self.assertEqual(play_bag.find_calibration(topics, "", "/axis/compressed"), (None, ""))


class Tests(SummaryTest, BagsTest):
    """All of them: unitrun takes one class."""


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "play_bag", Tests, sysargs=sys.argv)
