#!/usr/bin/python3
"""track_sequence --bag with recordings of ROS 2: the results of the same images. PROGRAMS names the folder of the
programs."""
import os
import sqlite3
import sys
import unittest

import cv2
import numpy
import rosunit
import yaml

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401
import ros2_bag  # noqa: E402
from track_sequence_runs import RunsOfARoom, content, report, rows, run_program  # noqa: E402

TOPICS = {"/camera/image_raw": "sensor_msgs/msg/Image", "/camera/camera_info": "sensor_msgs/msg/CameraInfo",
          "/other": "std_msgs/msg/String"}


class Rosbag2Test(RunsOfARoom):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with open(cls.camera) as f:
            camera = yaml.safe_load(f)
        cls.k = [float(v) for v in camera["camera_matrix"]["data"]]
        cls.d = [float(v) for v in camera["distortion_coefficients"]["data"]]
        cls.grey = [cv2.imread(os.path.join(cls.images, name), cv2.IMREAD_GRAYSCALE) for name in cls.names]
        # The reference: the same grey images from a folder.
        cls.grey_list = os.path.join(cls.made.name, "grey.txt")
        os.makedirs(os.path.join(cls.made.name, "grey"))
        with open(cls.grey_list, "w") as f:
            for stamp, name, pixels in zip(cls.stamps, cls.names, cls.grey):
                cv2.imwrite(os.path.join(cls.made.name, "grey", name), pixels)
                f.write("%s grey/%s\n" % (stamp, name))
        cls.expected = os.path.join(cls.made.name, "expected")
        result = run_program("track_sequence", "--images", cls.grey_list, "--camera", cls.camera, "--output", cls.expected,
                             "--quiet")
        assert result.returncode == 0, result.stderr

    def messages(self, make=ros2_bag.image, little=True):
        """Of the camera and of another topic, in the order of recording."""
        result = []
        for i, (stamp, pixels) in enumerate(zip(self.stamps, self.grey)):
            time = int(1e9 * (100 + float(stamp)))
            if make is ros2_bag.image:
                data = ros2_bag.image(float(stamp), pixels, little)
            else:
                data = make(float(stamp), cv2.imencode(".png", pixels)[1].tobytes())
            topic = "/camera/image_raw" + ("" if make is ros2_bag.image else "/compressed")
            height, width = pixels.shape
            result += [("/camera/camera_info", time, ros2_bag.camera_info(float(stamp), width, height, self.k, self.d, little)),
                       (topic, time + 1, data), ("/other", time + 2, ros2_bag.Cdr().text("hello").data)]
        return result

    def expect_the_same(self, bag, *arguments):
        output, told = self.track("--bag", bag, *arguments)
        self.assertEqual(told, "")
        for name in ("trajectory.txt", "points.ply"):
            self.assertEqual(content(output, name), content(self.expected, name), name)
        self.assertEqual(report(output)["problems"], [])

    def folder_of(self, name, storage):
        os.makedirs(self.path("drive"))
        ros2_bag.write_metadata(self.path("drive"), [name] if isinstance(name, str) else name, storage)
        return self.path("drive")

    def test_database_in_a_folder(self):
        folder = self.folder_of("drive_0.db3", "sqlite3")
        ros2_bag.write_db3(os.path.join(folder, "drive_0.db3"), TOPICS, self.messages())
        before = sorted(os.listdir(folder))
        self.expect_the_same(folder)
        self.expect_the_same(os.path.join(folder, "drive_0.db3"), "--image-topic", "camera/image_raw")
        self.assertEqual(sorted(os.listdir(folder)), before)

    def test_big_endian_and_split(self):
        folder = self.folder_of(["drive/drive_0.db3", "drive_1.db3"], "sqlite3")
        messages = self.messages(little=False)
        ros2_bag.write_db3(os.path.join(folder, "drive_0.db3"), TOPICS, messages[:30])
        ros2_bag.write_db3(os.path.join(folder, "drive_1.db3"), TOPICS, messages[30:])
        self.expect_the_same(folder)

    @unittest.skipUnless(ros2_bag.has_program("zstd"), "needs zstd")
    def test_compressed_message_by_message(self):
        os.makedirs(self.path("drive"))
        ros2_bag.write_metadata(self.path("drive"), ["drive_0.db3"], "sqlite3", "zstd")
        ros2_bag.write_db3(self.path("drive", "drive_0.db3"), TOPICS,
                           [(topic, time, ros2_bag.compressed("zstd", data)) for topic, time, data in self.messages()])
        self.expect_the_same(self.path("drive"))
        self.expect_the_same(self.path("drive", "drive_0.db3"))  # without metadata.yaml

    def test_many_parts_without_metadata(self):
        """By their numbers: drive_10 after drive_9."""
        os.makedirs(self.path("drive"))
        messages = self.messages()
        for i in range(12):
            part = messages[i * len(messages) // 12:(i + 1) * len(messages) // 12]
            ros2_bag.write_db3(self.path("drive", "drive_%d.db3" % i), TOPICS, part)
        self.expect_the_same(self.path("drive"))

    def test_files_that_were_decompressed_since(self):
        """rosbag2's compression of whole files: refused with what to do, and read once that was done."""
        folder = self.folder_of(["drive_0.db3.zstd"], "sqlite3")
        with open(os.path.join(folder, "drive_0.db3.zstd"), "wb") as f:
            f.write(b"\x28\xb5\x2f\xfd")
        self.expect_refused(["drive_0.db3.zstd", "zstd -d"], "--bag", folder)
        ros2_bag.write_db3(os.path.join(folder, "drive_0.db3"), TOPICS, self.messages())
        self.expect_the_same(folder)

    def test_mcap(self):
        tried = 0
        for compression in ("", "lz4", "zstd"):
            if not ros2_bag.has_program(compression):
                continue
            for summary in (True, False):
                path = self.path("drive.mcap")
                ros2_bag.write_mcap(path, TOPICS, self.messages(), compression, summary=summary)
                self.expect_the_same(path)
                tried += 1
        self.assertGreaterEqual(tried, 2)

    def test_mcap_without_chunks_and_with_compressed_images(self):
        topics = {"/camera/image_raw/compressed": "sensor_msgs/msg/CompressedImage", **TOPICS}
        del topics["/camera/image_raw"]
        path = self.path("drive.mcap")
        ros2_bag.write_mcap(path, topics, self.messages(ros2_bag.compressed_image), per_chunk=0)
        self.expect_the_same(path, "--image-topic", "/camera/image_raw")

    def test_a_recording_that_was_cut(self):
        path = self.path("drive.mcap")
        ros2_bag.write_mcap(path, TOPICS, self.messages(), summary=False)
        with open(path, "r+b") as f:
            f.truncate(os.path.getsize(path) * 3 // 4)
        output, _ = self.track("--bag", path)
        self.assertGreater(len(rows(output, "trajectory.txt")), len(self.names) // 2)

    def test_a_damaged_message_is_passed_over(self):
        messages = self.messages()
        at = [i for i, message in enumerate(messages) if message[0] == "/camera/image_raw"][12]
        messages[at] = (*messages[at][:2], messages[at][2][:100])
        ros2_bag.write_db3(self.path("drive.db3"), TOPICS, messages)
        output, told = self.track("--bag", self.path("drive.db3"))
        self.assertIn("image 000012 of /camera/image_raw: is truncated", told)
        self.assertEqual(report(output)["frames_total"], len(self.names) - 1)

    def test_grey_levels_of_16_bits(self):
        """12 significant bits are found, and --grey-levels is heeded, as of a folder of the same images."""
        images = [16 * pixels.astype(numpy.uint16) for pixels in self.grey]
        with open(self.path("deep.txt"), "w") as f:
            for stamp, name, pixels in zip(self.stamps, self.names, images):
                cv2.imwrite(self.path(name), pixels)
                f.write("%s %s\n" % (stamp, name))
        raw = [("/camera/image_raw", int(1e9 * float(stamp)), ros2_bag.image(float(stamp), pixels))
               for stamp, pixels in zip(self.stamps, images)]
        ros2_bag.write_db3(self.path("raw.db3"), TOPICS, raw)
        png = [("/camera/image_raw", time, ros2_bag.compressed_image(float(stamp), cv2.imencode(".png", pixels)[1].tobytes()))
               for (_, time, _), stamp, pixels in zip(raw, self.stamps, images)]
        ros2_bag.write_db3(self.path("png.db3"), {"/camera/image_raw": "sensor_msgs/msg/CompressedImage"}, png)
        found = []
        for levels in ("auto", "0:3000"):
            options = ("--camera", self.camera, "--grey-levels", levels)
            expected, _ = self.track("--images", self.path("deep.txt"), *options)
            found.append(content(expected, "points.ply"))
            for bag in ("raw.db3", "png.db3"):
                output, _ = self.track("--bag", self.path(bag), *options)
                for name in ("trajectory.txt", "points.ply"):
                    self.assertEqual(content(output, name), content(expected, name), (levels, bag, name))
        self.assertNotEqual(*found)

    def test_kinds_by_content(self):
        """A file is what its first bytes say, and messages without an order in the table come by time."""
        ros2_bag.write_db3(self.path("drive.bag"), TOPICS, self.messages()[::-1])
        self.expect_the_same(self.path("drive.bag"))

    def test_camera_info_next_to_compressed_images_without_a_base_name(self):
        topics = {"/axis/compressed": "sensor_msgs/msg/CompressedImage", "/axis/camera_info": TOPICS["/camera/camera_info"]}
        messages = [("/axis/" + topic.split("/")[-1], time, data)
                    for topic, time, data in self.messages(ros2_bag.compressed_image) if topic != "/other"]
        ros2_bag.write_db3(self.path("axis.db3"), topics, messages)
        self.expect_the_same(self.path("axis.db3"))

    def test_refusals(self):
        """One line that names the file, and what was expected."""
        def written(name, data):
            with open(self.path(name), "wb") as f:
                f.write(data)
            return self.path(name)
        ros2_bag.write_db3(self.path("none.db3"), {"/other": "std_msgs/msg/String"}, [])
        ros2_bag.write_mcap(self.path("sound.mcap"), TOPICS, self.messages()[:6])
        with sqlite3.connect(self.path("views.db3")) as database:
            database.execute("create view topics as select 1 as id, '/camera/image_raw' as name, 'sensor_msgs/msg/Image' as "
                             "type, 'cdr' as serialization_format")
            database.execute("create view messages as with recursive n(i) as (select 1 union all select i + 1 from n) select "
                             "i as id, 1 as topic_id, i as timestamp, x'00' as data from n")
        database.close()
        os.makedirs(self.path("empty"))
        os.makedirs(self.path("outside"))
        ros2_bag.write_db3(self.path("open.db3"), TOPICS, self.messages()[:6])
        written("open.db3-wal", b"messages")
        ros2_bag.write_metadata(self.path("outside"), ["../none.db3"], "sqlite3")
        bomb = ros2_bag.MCAP_MAGIC + ros2_bag._record(6, b"\0" * 16 + b"\xff" * 8 + b"\0" * 4 + ros2_bag._text("zstd") +
                                                      b"\0" * 8)
        for path, part in ((written("text.db3", b"nothing of the kind"), "expected a .db3 file"),
                           (written("text.mcap", b"nothing of the kind"), "expected an .mcap file"),
                           (written("nothing.mcap", b""), "expected an .mcap file"),
                           (written("bomb.mcap", bomb), "names no topic, so it is empty or damaged"),
                           (self.path("none.db3"), "has no image topic"),
                           (self.path("views.db3"), "no tables"),
                           (self.path("empty"), "holds no recording"),
                           (self.path("outside"), "outside the folder"),
                           (self.path("open.db3"), "was not closed"),
                           (written("whole.db3.zstd", b"x"), "compressed as a whole"),
                           (self.path("missing.db3"), "is not a regular file")):
            self.expect_refused([os.path.basename(path).split(".")[0], part], "--bag", path, "--camera", self.camera)
        self.expect_refused(["sound.mcap", "a single --bag"], "--bag", self.path("sound.mcap"), "--bag", self.path("none.db3"))
        self.expect_refused(["/camera/image_raw", "/nowhere"], "--bag", self.path("sound.mcap"), "--image-topic", "/nowhere")


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "rosbag2", "__main__", sysargs=sys.argv)
