#!/usr/bin/python3
"""What recording_to_bag writes: the images that track_sequence sees, with its stamps. PROGRAMS names the programs' folder."""
import os
import resource
import signal
import stat
import subprocess
import sys
import tempfile
import time
import unittest

import cv2
import numpy
import rosbag
import rosunit
from cv_bridge import CvBridge

WIDTH, HEIGHT, COUNT, FPS = 64, 48, 5, 12.5
CAMERA = """image_width: 64
image_height: 48
camera_name: c
camera_matrix: {rows: 3, cols: 3, data: [50, 0, 31.5, 0, 50, 23.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0.1, 0, 0, 0, 0]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [50, 0, 31.5, 0, 0, 50, 23.5, 0, 0, 0, 1, 0]}
"""


class RecordingToBag(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        smooth = cv2.GaussianBlur(numpy.random.RandomState(1).randint(0, 256, (HEIGHT, WIDTH, 3), numpy.uint8), (0, 0), 3)
        self.images = [numpy.roll(smooth, 5 * i, axis=1) for i in range(COUNT)]
        os.mkdir(self.path("images"))
        for i, image in enumerate(self.images):
            cv2.imwrite(self.path("images", f"{i}.png"), image)
        with open(self.path("camera.yaml"), "w") as file:
            file.write(CAMERA)

    def path(self, *parts):
        return os.path.join(self.folder, *parts)

    def write(self, name, text):
        with open(self.path(name), "w") as file:
            file.write(text)
        return self.path(name)

    def run_program(self, *arguments):
        program = os.path.join(os.environ["PROGRAMS"], "recording_to_bag")
        return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=60)

    def messages(self, recording, *options):
        """{topic: messages}"""
        bag = self.path("out.bag")
        result = self.run_program(recording, bag, *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        topics = {}
        with rosbag.Bag(bag) as content:
            for topic, message, stamp in content.read_messages():
                self.assertEqual(max(message.header.stamp.to_nsec(), 1), stamp.to_nsec())
                topics.setdefault(topic, []).append(message)
        return topics

    def seconds(self, messages):
        return [m.header.stamp.to_sec() for m in messages]

    def test_a_folder(self):
        topics = self.messages(self.path("images"), "--camera", self.path("camera.yaml"))
        self.assertEqual(set(topics), {"/camera/image_raw", "/camera/camera_info"})
        images, infos = topics["/camera/image_raw"], topics["/camera/camera_info"]
        self.assertEqual(self.seconds(images), [0, 1, 2, 3, 4], "as track_sequence stamps a folder")
        self.assertEqual(self.seconds(infos), self.seconds(images))
        self.assertEqual(infos[0].K[0], 50)
        self.assertEqual(list(infos[0].D), [0.1, 0, 0, 0, 0])
        for message, image in zip(images, self.images):
            numpy.testing.assert_array_equal(CvBridge().imgmsg_to_cv2(message, "bgr8"), image)

    def test_a_list_with_stamps_and_one_without(self):
        stamped = self.write("stamped.txt", "# a comment\n100.25 images/3.png\n100.5 images/1.png\n")
        images = self.messages(stamped)["/camera/image_raw"]
        self.assertEqual(self.seconds(images), [100.25, 100.5])
        numpy.testing.assert_array_equal(CvBridge().imgmsg_to_cv2(images[0], "bgr8"), self.images[3])
        bare = self.write("bare.txt", "images/3.png\nimages/1.png\n")
        self.assertEqual(self.seconds(self.messages(bare)["/camera/image_raw"]), [0, 1])

    def test_the_list_of_a_folder(self):
        self.write("images.txt", "7.5 images/2.png\n")
        self.assertEqual(self.seconds(self.messages(self.folder)["/camera/image_raw"]), [7.5])

    def test_a_video_compressed(self):
        video = self.path("video.avi")
        writer = cv2.VideoWriter(video, cv2.VideoWriter_fourcc(*"MJPG"), FPS, (WIDTH, HEIGHT))
        for image in self.images:
            writer.write(image)
        writer.release()
        topics = self.messages(video, "--compressed")
        self.assertEqual(set(topics), {"/camera/image_raw/compressed"})
        messages = topics["/camera/image_raw/compressed"]
        numpy.testing.assert_allclose(self.seconds(messages), [i / FPS for i in range(COUNT)], atol=1e-9)
        self.assertEqual(messages[0].format, "jpeg")
        for message, image in zip(messages, self.images):
            difference = cv2.absdiff(CvBridge().compressed_imgmsg_to_cv2(message, "bgr8"), image)
            self.assertLess(difference.mean(), 6)  # grey levels that JPEG costs, twice
        coarse = self.messages(video, "--compressed", "--quality", "10")["/camera/image_raw/compressed"]
        self.assertLess(sum(len(m.data) for m in coarse), 0.8 * sum(len(m.data) for m in messages))  # 64x48: mostly heads

    def test_what_is_wrong_is_one_line_and_no_bag(self):
        other = self.write("other.yaml", CAMERA.replace("image_width: 64", "image_width: 65"))
        empty = self.path("empty")
        os.mkdir(empty)
        for arguments, words in (((self.path("none.mp4"),), "none.mp4"), ((empty,), "empty"),
                                 ((self.path("images"), "--camera", other), "65x48"),
                                 ((self.path("images"), "--camera", self.path("none.yaml")), "none.yaml"),
                                 ((self.path("images"), "--quality", "0"), "--quality")):
            result = self.run_program(arguments[0], self.path("bad.bag"), *arguments[1:])
            self.assertEqual(result.returncode, 2, arguments)
            self.assertIn(words, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
            self.assertEqual([f for f in os.listdir(self.folder) if f.startswith("bad.bag")], [])

    def test_what_is_read_stays(self):
        before = cv2.imread(self.path("images", "0.png"))
        for bag in ("images/0.png", "images/../camera.yaml"):
            result = self.run_program(self.path("images"), self.path(bag), "--camera", self.path("camera.yaml"))
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn("would be written over", result.stderr)
        numpy.testing.assert_array_equal(cv2.imread(self.path("images", "0.png")), before)
        listed = self.write("out.bag.part", "images/3.png\n")
        os.rename(listed, self.path("part.txt"))
        os.link(self.path("part.txt"), listed)
        self.messages(self.path("part.txt"))
        with open(listed) as file:
            self.assertEqual(file.read(), "images/3.png\n")

    def test_stamps_that_no_message_holds(self):
        for stamp in ("-0.5", "4294967296"):
            listed = self.write("list.txt", "1 images/0.png\n%s images/1.png\n" % stamp)
            result = self.run_program(listed, self.path("bad.bag"))
            self.assertEqual((result.returncode, result.stderr.count("\n")), (2, 1), result.stderr)
            self.assertIn("images/1.png: the time stamp " + stamp, result.stderr)
            self.assertFalse(os.path.exists(self.path("bad.bag")))

    def start(self, recording, **options):
        return subprocess.Popen([os.path.join(os.environ["PROGRAMS"], "recording_to_bag"), recording, self.path("out.bag")],
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)

    def test_two_that_write_one_bag(self):
        """Each writes a whole one, of which one stays."""
        listed = self.write("list.txt", "".join("%d images/%d.png\n" % (i, i % COUNT) for i in range(2000)))
        for process in [self.start(listed) for _ in range(3)]:
            said = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 0, said)
        with rosbag.Bag(self.path("out.bag")) as bag:
            self.assertEqual(len([m.data for _, m, _ in bag.read_messages()]), 2000)
        self.assertEqual(sorted(os.listdir(self.folder)), ["camera.yaml", "images", "list.txt", "out.bag"])

    def test_interrupted_it_leaves_nothing(self):
        listed = self.write("list.txt", "".join("%d images/%d.png\n" % (i, i % COUNT) for i in range(200000)))
        process = self.start(listed)
        while not [name for name in os.listdir(self.folder) if name.endswith(".part")]:
            self.assertIsNone(process.poll())
            time.sleep(0.002)  # leaves the program its processor
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.communicate(timeout=60)[1], "recording_to_bag: interrupted\n")
        self.assertEqual(process.returncode, 130)
        self.assertEqual(sorted(os.listdir(self.folder)), ["camera.yaml", "images", "list.txt"])

    def test_a_limit_of_the_size_of_files_is_told(self):
        process = self.start(self.path("images"),
                             preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000)))
        said = process.communicate(timeout=60)[1]
        self.assertEqual((process.returncode, said.count("\n")), (2, 1), said)
        self.assertIn("cannot be written", said)
        self.assertEqual(sorted(os.listdir(self.folder)), ["camera.yaml", "images"])

    def test_what_is_no_file_is_not_replaced(self):
        os.mkfifo(self.path("pipe"))
        result = self.run_program(self.path("images"), self.path("pipe"))
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("is not a regular file", result.stderr)
        self.assertTrue(stat.S_ISFIFO(os.stat(self.path("pipe")).st_mode))
        self.write("old.bag", "")
        os.symlink(self.path("old.bag"), self.path("link.bag"))
        self.assertEqual(self.run_program(self.path("images"), self.path("link.bag")).returncode, 0)
        self.assertTrue(os.path.islink(self.path("link.bag")))
        with rosbag.Bag(self.path("old.bag")) as bag:
            self.assertEqual(bag.get_message_count(), COUNT)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "recording_to_bag", RecordingToBag, sysargs=sys.argv)
