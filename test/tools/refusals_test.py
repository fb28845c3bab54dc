#!/usr/bin/python3
"""What track_sequence refuses, and that it says why and writes nothing. PROGRAMS names the folder of the program."""
import os
import resource
import shutil
import struct
import sys

import cv2
import numpy
import rosunit
import yaml

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401
from track_sequence_runs import RunsOfARoom, content, run_program  # noqa: E402


def stretch_pixels(path, width, height):
    """States the shape of its pixels (the box pasp) in a video that OpenCV has written, whose index is at its end."""
    with open(path, "rb") as f:
        data = bytearray(f.read())
    at, sizes = 0, []
    for kind in (b"moov", b"trak", b"mdia", b"minf", b"stbl", b"stsd", b"mp4v"):
        at = data.index(kind, at)
        sizes.append(at - 4)
    pasp = struct.pack(">I4sII", 16, b"pasp", width, height)
    end = sizes[-1] + struct.unpack_from(">I", data, sizes[-1])[0]
    for size in sizes:
        struct.pack_into(">I", data, size, struct.unpack_from(">I", data, size)[0] + len(pasp))
    data[end:end] = pasp
    with open(path, "wb") as f:
        f.write(data)


class Refusals(RunsOfARoom):
    def list_with_stamp(self, stamp):
        with open(self.path("list.txt"), "w") as f:
            f.writelines(["1 %s\n" % os.path.join(self.images, self.names[0]),
                          "%s %s\n" % (stamp, os.path.join(self.images, self.names[1]))])
        return self.path("list.txt")

    def changed_camera(self, change):
        camera = yaml.safe_load(content(self.camera))
        change(camera)
        with open(self.path("camera.yaml"), "w") as f:
            yaml.safe_dump(camera, f)
        return self.path("camera.yaml")

    def cut_jpeg(self):
        """Of the right size by its head, and its end mark is there."""
        coded = cv2.imencode(".jpg", cv2.imread(os.path.join(self.images, self.names[0])))[1].tobytes()
        with open(self.path("cut.jpg"), "wb") as f:
            f.write(coded[:len(coded) // 2] + b"\xff\xd9")
        return self.path("cut.jpg")

    def test_first_image_of_another_size_is_refused(self):
        images = self.copy_of_images()
        self.resize(os.path.join(images, self.names[0]))
        self.expect_refused([self.names[0], "160x120", "320x240"], "--images", images, "--camera", self.camera)

    def test_pixels_that_are_not_square_are_named(self):
        """Of a video that is shown at the size of the calibration, but stored at another."""
        video = self.path("stretched.mp4")
        writer = cv2.VideoWriter(video, cv2.VideoWriter_fourcc(*"mp4v"), 10, (240, 240))
        for _ in range(3):
            writer.write(numpy.zeros((240, 240, 3), numpy.uint8))
        writer.release()
        stretch_pixels(video, 4, 3)
        self.expect_refused(["240x240", "320x240", "pixel aspect ratio (width / height) of 1.333", "as they are stored"],
                            "--video", video, "--camera", self.camera)

    def test_bad_calibration_is_refused(self):
        images = ["--images", self.list]
        self.expect_refused(["--camera"], *images)
        self.expect_refused(["none.yaml"], *images, "--camera", "none.yaml")

        def zero_focal_length(camera):
            camera["camera_matrix"]["data"][0] = 0.0

        def other_model(camera):
            camera["distortion_model"] = "fisheye_of_mine"
            camera["distortion_coefficients"]["data"][0] = 0.1

        self.expect_refused(["camera.yaml", "expected"], *images, "--camera", self.changed_camera(zero_focal_length))
        self.expect_refused(["camera.yaml", "fisheye_of_mine", "plumb_bob"], *images, "--camera",
                            self.changed_camera(other_model))

    def test_bad_input_is_refused(self):
        camera = ["--camera", self.camera]
        self.expect_refused(["--images", "--video", "--bag"], *camera)
        os.mkdir(self.path("empty"))
        self.expect_refused([self.path("empty"), "no image"], *camera, "--images", self.path("empty"))
        self.expect_refused(["/no/such/place"], *camera, "--images", "/no/such/place")
        self.expect_refused(["gone.png"], *camera, "--images", self.list_of(["gone.png", "lost.png"]))
        self.expect_refused(["cut.jpg", "ends too early"], *camera, "--images", self.list_of([self.cut_jpeg()]))
        self.expect_refused(["none.avi"], *camera, "--video", "none.avi")
        self.expect_refused(["none.bag"], "--bag", "none.bag")
        self.expect_refused(["/camera/image_raw", "/no/topic"], "--bag", os.path.join(self.sequence, "sequence.bag"),
                            "--image-topic", "/no/topic")
        cv2.VideoWriter(self.path("no_frames.avi"), cv2.VideoWriter_fourcc(*"MJPG"), 10, (320, 240)).release()
        self.expect_refused([self.path("no_frames.avi")], *camera, "--video", self.path("no_frames.avi"))
        self.expect_refused(["a?b.yaml"], "--images", self.list, "--camera", "a\nb.yaml")
        self.expect_refused(["--hfov", "nan"], "--images", self.list, "--hfov", "nan")
        self.expect_refused(["--nonsense is not an option: expected one of those that --help lists"], *camera, "--images", self.list, "--nonsense")
        os.mkdir(self.path("listed"))
        shutil.copy(self.list, self.path("listed", "images.txt"))
        self.expect_refused([self.path("listed", "images.txt")], *camera, "--images", self.path("listed"))
        misspelt = run_program("track_sequence", *camera, "--images", self.list, "--outpt", self.path("refused"))
        self.assertEqual(misspelt.returncode, 2)
        self.assertIn("--outpt is not an option; --output is required", misspelt.stderr)
        for option, values in (("--max-frames", ("0", "-1", "010", "x")), ("--seed", ("-1", "0100", "0x1", "1.5"))):
            for value in values:
                self.expect_refused([option, "expected a whole number"], *camera, "--images", self.list,
                                    option + "=" + value)
        self.expect_refused(["list.txt", "line 2", "99999999999"], *camera, "--images",
                            self.list_with_stamp("99999999999"))
        self.expect_refused(["/no/masks"], *camera, "--images", self.list, "--masks", "/no/masks")

    def test_endless_files_are_refused(self):
        """A device that never ends is not read until the memory is full: at most the 256 MB that a list may have."""
        images, camera, endless = ["--images", self.list], ["--camera", self.camera], "/dev/zero"
        seconds = 10 * float(os.environ.get("MONO_POSE_TRACKER_SLOWNESS", "1"))
        for part, arguments in (("more than 262144 bytes", [*images, "--camera", endless]),
                                ("more than 262144 bytes", [*images, *camera, "--config", endless]),
                                ("is neither a folder", [*camera, "--images", endless]),
                                ("more than 268435456 bytes", [*images, *camera, "--reference", endless]),
                                ("is a stream or device", [*camera, "--video", endless]),
                                ("is not a regular file", ["--bag", endless]),
                                ("Not a directory", [*images, *camera, "--masks", endless]),
                                ("is not a regular file", [*images, *camera, "--map", endless])):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            self.expect_refused([endless, part], *arguments)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            # Of the processor, not of the clock: the machine may be busy.
            self.assertLess(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, seconds, arguments)
            self.assertLess(after.ru_maxrss, 1.5 * 2**20, arguments)  # kB, of the largest program so far

    def test_unwritable_output_folder_is_refused(self):
        with open(self.path("file"), "w") as f:
            f.write("a file")
        below = self.path("file", "out")
        self.expect_refused([below], "--images", self.list, "--camera", self.camera, output=below)

    def test_what_is_read_is_not_written_over(self):
        room, camera = self.path("room"), ["--camera", self.path("room", "camera.yaml")]
        shutil.copytree(self.sequence, room)
        images = ["--images", os.path.join(room, "images.txt")]
        before = {name: content(os.path.join(room, name)) for name in ("camera.yaml", "images.txt", "groundtruth.txt")}
        for arguments in ([*images, *camera, "--save-map", self.path("room", "camera.yaml")],
                          [*images, *camera, "--save-map", self.path("room", "images", "..", "images.txt")],
                          [*images, *camera, "--masks", self.path("room", "masks"), "--write-masks", self.path("room", "masks")],
                          [*images, *camera, "--write-masks", self.path("room", "images")],
                          [*images, *camera, "--save-map", self.path("room", "images", self.names[3])]):
            self.expect_refused(["would be written over"], *arguments)
        with open(self.path("room", "two_folders.txt"), "w") as f:  # whose names hold their folders
            f.writelines("%s/%s\n" % (folder, self.names[0]) for folder in ("images", "masks"))
        self.expect_refused([self.path("room", "images", self.names[0])], "--images", self.path("room", "two_folders.txt"),
                            *camera, "--write-masks", room)
        os.rename(os.path.join(room, "groundtruth.txt"), os.path.join(room, "trajectory.txt"))
        result = run_program("track_sequence", *images, *camera, "--reference", self.path("room", "trajectory.txt"),
                             "--output", room)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("trajectory.txt: would be written over", result.stderr)
        os.rename(os.path.join(room, "trajectory.txt"), os.path.join(room, "groundtruth.txt"))
        self.assertEqual({name: content(os.path.join(room, name)) for name in before}, before)

    def refusal(self, *arguments):
        """What it says as it refuses to write into a folder that is there."""
        result = run_program("track_sequence", *arguments)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        return result.stderr

    def test_a_list_in_the_folder_of_a_model_is_not_written_over(self):
        """COLMAP's file of the images has the name that the list has."""
        for folder in ("colmap", os.path.join("map_3", "colmap")):
            output = self.path(folder.replace("/", "_"))
            os.makedirs(os.path.join(output, folder))
            listed = os.path.join(output, folder, "images.txt")
            with open(listed, "w") as f:
                f.writelines("%s\n" % os.path.join(self.images, name) for name in self.names)
            before = content(listed)
            said = self.refusal("--images", listed, "--camera", self.camera, "--output", output)
            self.assertIn(os.path.join(folder, "images.txt") + ": would be written over", said)
            self.assertEqual(content(listed), before)

    def test_results_do_not_lie_among_the_images(self):
        """The folder of images is read more than once: the picture of the map would be one of them."""
        further = self.path("out", "map_2")
        shutil.copytree(self.images, further)
        images = self.copy_of_images()
        for folder, output in ((images, images), (images, os.path.join(images, "..", "images")), (further, self.path("out"))):
            said = self.refusal("--images", folder, "--camera", self.camera, "--output", output)
            self.assertIn("expected another folder as --output", said)
            self.assertEqual(sorted(os.listdir(folder)), self.names)
        self.assertEqual(os.listdir(self.path("out")), ["map_2"])
        # What lies below it is none of its images.
        result = run_program("track_sequence", "--images", images, "--camera", self.camera, "--max-frames", "1", "--output",
                             os.path.join(images, "result"))
        self.assertEqual(result.returncode, 1, result.stderr)  # one image makes no map

    def test_masks_that_are_read_are_not_written_over_by_others(self):
        output = self.path("out")
        shutil.copytree(os.path.join(self.sequence, "masks"), os.path.join(output, "frames"))
        said = self.refusal("--bag", os.path.join(self.sequence, "sequence.bag"), "--write-frames", "--masks",
                            os.path.join(output, "frames"), "--output", output)
        self.assertIn("000000.png: would be written over", said)
        # What else is below the folder of the masks is none of them.
        with open(self.path("report.json"), "w"):
            pass
        result = run_program("track_sequence", "--images", self.list, "--camera", self.camera, "--max-frames", "1", "--masks",
                             self.folder.name, "--output", self.folder.name, "--write-masks", self.path("written"))
        self.assertEqual(result.returncode, 1, result.stderr)  # one image makes no map

    def test_outputs_do_not_write_over_each_other(self):
        output = self.path("out")
        os.mkdir(output)
        images = ["--images", self.list, "--camera", self.camera, "--output", output]
        for name in ("report.json", "trajectory.txt", "points.ply"):
            self.assertIn(name + ": would be written twice, by --output and by --save-map",
                          self.refusal(*images, "--save-map", os.path.join(output, name)))
        frames = ["--bag", os.path.join(self.sequence, "sequence.bag"), "--output", output, "--write-frames"]
        self.assertIn("by --write-frames and by --write-masks",
                      self.refusal(*frames, "--write-masks", os.path.join(output, "frames")))
        self.assertIn("by --undistorted and by --write-masks",
                      self.refusal(*images, "--undistorted", "--write-masks",
                                   os.path.join(output, "undistorted", "images")))
        self.assertEqual(os.listdir(output), [])

    def test_files_that_are_in_an_output_folder_stay(self):
        output = self.path("out")
        for name in (".writable", "trajectory.txt.part", "a.map.part"):
            os.makedirs(output, exist_ok=True)
            with open(os.path.join(output, name), "w") as f:
                f.write("a user's own")
        result = run_program("track_sequence", "--images", self.list, "--camera", self.camera, "--max-frames", "1",
                             "--output", output, "--save-map", os.path.join(output, "a.map"), "--quiet")
        self.assertEqual(result.returncode, 1, result.stderr)  # one image makes no map
        for name in (".writable", "trajectory.txt.part", "a.map.part"):
            self.assertEqual(content(output, name), b"a user's own", name)

    def test_what_cannot_be_written_is_told_before_the_work(self):
        images = ["--images", self.list, "--camera", self.camera]
        self.expect_refused(["/proc/a.map"], *images, "--save-map", "/proc/a.map")
        self.expect_refused(["File name too long"], *images, "--save-map", self.path(256 * "a"))
        self.expect_refused(["/proc"], *images, "--write-masks", "/proc")

    def test_an_option_that_is_given_nothing_is_refused(self):
        """Most likely a variable of a script that is not set."""
        for option in ("--masks", "--config", "--save-map", "--reference"):
            self.expect_refused([option], "--images", self.list, "--camera", self.camera, option, "")
        with open(self.path("empty.txt"), "w"):
            pass
        self.expect_refused(["empty.txt: holds no pose"], "--images", self.list, "--camera", self.camera, "--reference",
                            self.path("empty.txt"))

    def test_pipes_are_refused(self):
        """Nobody writes into it: to open it would wait for ever."""
        pipe, config = self.path("pipe"), self.path("tracker.yaml")
        os.mkfifo(pipe)
        self.expect_refused([pipe], "--images", pipe, "--camera", self.camera)
        with open(config, "w") as f:
            f.write("segmentation: {method: background, background_image: %s}\n" % pipe)
        self.expect_refused([pipe], "--images", self.list, "--camera", self.camera, "--config", config)

    def test_bad_options_are_refused(self):
        images = ["--images", self.list, "--camera", self.camera, "--config"]
        config = self.path("tracker.yaml")
        for text, parts in (("confidense: 0.9\n", ["confidense", "confidence"]), ("confidence: 2\n", ["confidence", "2"]),
                            ("confidence: [\n", []), ("a: &a\n  b: *a\n", ["line 2"]), ("seed: 0100\n", ["0100"]),
                            ("seed: 1\n---\nseed: 2\n", ["line 3", "second document"]),
                            ("confidence: 1\n", ["to 0.999999999"])):
            with open(config, "w") as f:
                f.write(text)
            self.expect_refused([config, *parts], *images, config)
        self.expect_refused(["none.yaml"], *images, "none.yaml")
        self.expect_refused([self.folder.name, "it is a folder"], *images, self.folder.name)
        with open(config, "w") as f:
            f.write("scale:\n  known_baseline: 1.0e-10\n")
        self.expect_refused(["known_baseline", "1e-06"], *images, config)
        background = self.path("background.png")
        cv2.imwrite(background, numpy.zeros((60, 80, 3), numpy.uint8))
        with open(config, "w") as f:
            f.write("segmentation: {method: background, background_image: %s}\n" % background)
        self.expect_refused(["background_image", "80x60", "320x240"], *images, config)
        with open(self.path("cut.jpg"), "wb") as f:
            f.write(cv2.imencode(".jpg", numpy.random.RandomState(1).randint(0, 256, (240, 320, 3), numpy.uint8))[1][:20000])
        with open(config, "w") as f:
            f.write("segmentation: {method: background, background_image: %s}\n" % self.path("cut.jpg"))
        self.expect_refused(["background_image", "cut.jpg"], *images, config)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "refusals", "__main__", sysargs=sys.argv)
