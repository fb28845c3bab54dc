#!/usr/bin/python3
"""The launch files pass roslaunch's own check, say what every argument is, hand each one on, and start: as roslaunch is
typed, with a small bag or video, on a master of their own."""
import functools
import glob
import json
import math
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from xml.etree import ElementTree

import roslaunch.config
import roslaunch.rlutil
import rosunit
import yaml

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
FOLDER = os.path.join(ROOT, "launch")
FILES = sorted(glob.glob(os.path.join(FOLDER, "*.launch")))
PROGRAMS = os.environ["PROGRAMS"]
TIMEOUT = 60  # s; on a busy machine everything takes its time

# What the interface says they hand on, beside what is their own.
COMMON = {"base_frame", "odom_frame", "map_orientation", "object_origin", "trajectory_file", "map_path", "hfov",
          "map_frame", "load_map_at_start", "localize_only"}


def arguments_of(name):
    return {arg.get("name"): arg.get("default")
            for arg in ElementTree.parse(os.path.join(FOLDER, name)).getroot().findall("arg")}


@functools.lru_cache(maxsize=None)
def load_cached(name, arguments):
    return load_now(name, dict(arguments))


def load(name, /, **arguments):
    """The parameters and the nodes (name, arguments, remaps, whether all ends with it) that a launch file comes to. Of
    a bag raw images are played: to find out costs a process."""
    if "bag" in arguments and "image_transport" in arguments_of(name):
        arguments.setdefault("image_transport", "raw")
    return load_cached(name, tuple(sorted(arguments.items())))


def config_of(name, arguments):
    arguments = [f"{key}:={value}" for key, value in arguments.items()]
    return roslaunch.config.load_config_default([(os.path.join(FOLDER, name), arguments)], None)


def load_now(name, arguments):
    config = config_of(name, arguments)
    nodes = [(node.namespace, node.name, node.args, str(node.remap_args), node.required) for node in config.nodes]
    return {key: param.value for key, param in config.params.items()}, nodes


class Recording:
    """A bag of a few small images, raw and compressed."""

    def __init__(self, folder, frames=12, width=160):
        subprocess.run([os.path.join(PROGRAMS, "simulate_sequence"), "--scene", "room", "--output", folder, "--frames",
                        str(frames), "--width", str(width), "--height", str(width * 3 // 4), "--samples", "1", "--quiet"],
                       check=True)
        self.bag = os.path.join(folder, "sequence.bag")
        self.both, self.packed = os.path.join(folder, "both.bag"), os.path.join(folder, "packed.bag")
        self.camera, self.truth = os.path.join(folder, "camera.yaml"), os.path.join(folder, "groundtruth.txt")
        import rosbag
        from cv_bridge import CvBridge
        bridge = CvBridge()
        with rosbag.Bag(self.bag) as bag, rosbag.Bag(self.both, "w") as both, rosbag.Bag(self.packed, "w") as packed:
            for topic, message, stamp in bag.read_messages():
                both.write(topic, message, stamp)
                if topic != "/camera/image_raw":
                    continue
                compressed = bridge.cv2_to_compressed_imgmsg(bridge.imgmsg_to_cv2(message, "bgr8"))
                compressed.header = message.header
                for target in (both, packed):
                    target.write(topic + "/compressed", compressed, stamp)


class LaunchFilesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        cls.recording = Recording(folder.name)
        os.environ["XDG_CACHE_HOME"] = folder.name + "/cache"  # where demo.launch looks
        os.makedirs(folder.name + "/cache/mono_pose_tracker/demo")
        os.symlink(cls.recording.bag, folder.name + "/cache/mono_pose_tracker/demo/sequence.bag")

    def test_there_are_launch_files(self):
        self.assertLessEqual({"bag.launch", "camera.launch", "demo.launch", "tracker.launch", "object.launch"},
                             {os.path.basename(f) for f in FILES})

    def test_roslaunch_finds_no_fault(self):
        for file in FILES:
            # Arguments without a default (bag:=) are the user's to give.
            self.assertIsNone(roslaunch.rlutil.check_roslaunch(file, ignore_unset_args=True), file)

    def test_every_argument_is_documented(self):
        for file in FILES:
            for arg in ElementTree.parse(file).getroot().findall("arg"):
                self.assertTrue(arg.get("doc"), f"{file}: {arg.get('name')}")

    def test_the_common_arguments_are_there(self):
        for name in ("bag.launch", "camera.launch", "object.launch"):
            self.assertLessEqual(COMMON, set(arguments_of(name)), name)
        for name in ("bag.launch", "object.launch", "demo.launch"):
            self.assertIn("play_args", arguments_of(name), name)

    def test_every_argument_reaches_something(self):
        """Another value of any argument changes a parameter or a node."""
        another = {"rviz": "false", "camera_info_source": "file", "grey_levels": "12", "object_mode": "true", "rectified": "true", "queue_size": "7", "hfov": "61.5",
                   "width": "321", "height": "123", "rate": "2.5", "map_orientation": "z_up", "object_origin": "centre",
                   "config": os.path.join(ROOT, "config", "fast.yaml"), "driver": "own",
                   "bag": self.recording.both, "image_transport": "compressed", "method": "chroma",
                   "load_map_at_start": "true", "localize_only": "true", "required": "true"}
        given = {"bag.launch": {"bag": self.recording.both}, "demo.launch": {"bag": self.recording.packed}}
        for file in FILES:
            name = os.path.basename(file)
            given_here = dict(given.get(name, {}))
            for argument in arguments_of(name):
                changed = {**given_here, argument: another.get(argument, "changed")}
                before = given_here
                if name == "bag.launch" and argument == "bag":
                    before = {"bag": self.recording.bag}
                if name == "bag.launch" and argument == "image_topic":
                    changed["image_topic"] = "camera/image_raw"  # in the bag, but relative
                if name == "object.launch" and argument in ("rate", "play_args"):  # of a bag
                    before = {"bag": self.recording.both}
                    changed.update(before)
                if name == "object.launch" and argument == "map_frame":
                    continue  # documented as of no effect; accepted as it is elsewhere
                self.assertNotEqual(load(name, **before), load(name, **changed), f"{name} {argument}")

    def test_what_an_earlier_launch_has_set_is_cleared(self):
        """Below the tracker's name alone, and before anything is set: roslaunch clears all that is to be cleared first."""
        bag = {"bag": self.recording.bag, "image_transport": "raw"}
        for name, arguments, cleared in (("tracker.launch", {}, "/tracker/"), ("tracker.launch", {"name": "left"}, "/left/"),
                                         ("tracker.launch", {"manager": "/manager"}, "/tracker/"),
                                         ("bag.launch", bag, "/tracker/"), ("camera.launch", {}, "/tracker/"),
                                         ("object.launch", {}, "/tracker/"), ("object.launch", bag, "/tracker/")):
            self.assertEqual(config_of(name, arguments).clear_params, [cleared], f"{name} {arguments}")

    def test_what_a_file_sets_around_the_tracker_holds(self):
        path = self.folder + "/around.launch"
        with open(path, "w") as around:
            around.write(f"""<launch><group ns="left"><include file="{FOLDER}/tracker.launch"/></group>
                             <param name="left/tracker/seed" value="7"/>
                             <param name="left/tracker/map_path" value="/left.map"/></launch>""")
        config = config_of(path, {})
        self.assertEqual(config.clear_params, ["/left/tracker/"])
        for key, value in (("seed", 7), ("map_path", "/left.map")):
            self.assertEqual(config.params["/left/tracker/" + key].value, value)

    def test_localize_only_holds_from_the_file_and_from_the_argument(self):
        config = self.folder + "/localize.yaml"
        for told, expected in (({}, False), ({"localize_only": True}, True), ({"localize_only": False}, False)):
            with open(config, "w") as file:
                yaml.safe_dump({"seed": 1, **told}, file)
            by_file = load_now("tracker.launch", {"config": config})[0]
            self.assertIs(by_file.get("/tracker/localize_only", False), expected, told)
            both = load_now("tracker.launch", {"config": config, "localize_only": "true"})[0]
            self.assertIs(both["/tracker/localize_only"], True, told)

    def test_an_unknown_argument_is_an_error(self):
        """To those who include the files; at its own command line roslaunch takes any, without a word."""
        path = self.folder + "/unknown.launch"
        for file in FILES:
            with open(path, "w") as including:
                including.write(f"""<launch><include file="{file}"><arg name="bag" value="{self.recording.bag}"/>
                                    <arg name="no_such_argument" value="1"/></include></launch>""")
            with self.assertRaisesRegex(Exception, "no_such_argument", msg=file):
                roslaunch.config.load_config_default([(path, [])], None)

    def test_topics_follow_the_image_topic(self):
        for topic, prefix in (("/cam/image_raw", "/cam/"), ("/image_raw", "/"), ("image_raw", ""),
                              ("cam/image_raw", "cam/")):
            nodes = load("tracker.launch", image_topic=topic)[1]
            remaps = next(remaps for _, name, _, remaps, _ in nodes if name == "tracker")
            self.assertIn(f"'camera_info', '{prefix}camera_info'", remaps)
            self.assertIn(f"'mask', '{prefix}mask'", remaps)

    def rviz(self, name, **arguments):
        return next(args for _, node, args, _, _ in load(name, **arguments)[1] if node == "rviz")

    def test_rviz_is_fixed_to_the_map(self):
        for name, arguments in (("bag.launch", {"bag": self.recording.bag}), ("camera.launch", {})):
            self.assertRegex(self.rviz(name, map_frame="field", **arguments), r"^-d \S+/config/tracker\.rviz -f field$")

    def test_rviz_of_an_object_has_a_set_up_of_its_own(self):
        """Whose Fixed Frame is the camera's: none is given beside it."""
        for name, arguments in (("object.launch", {}), ("object.launch", {"bag": self.recording.bag}),
                                ("bag.launch", {"bag": self.recording.bag, "object_mode": "true"}),
                                ("camera.launch", {"object_mode": "true"})):
            arguments_of_rviz = self.rviz(name, **arguments).split()
            self.assertEqual(arguments_of_rviz[0], "-d")
            self.assertTrue(os.path.samefile(arguments_of_rviz[1], os.path.join(ROOT, "config", "object.rviz")))
            self.assertEqual(len(arguments_of_rviz), 2)

    def test_the_object_is_found_as_the_config_file_says(self):
        """Unless an argument is given."""
        config = self.folder + "/blue_box.yaml"
        told = {"method": "chroma", "chroma_color": "blue", "background_image": "/wall.png", "body": "largest"}
        with open(config, "w") as file:
            yaml.safe_dump({"segmentation": told}, file)

        def segmentation(**arguments):
            parameters = load("object.launch", config=config, **arguments)[0]
            prefix = "/tracker/segmentation/"
            return {key[len(prefix):]: value for key, value in parameters.items() if key.startswith(prefix)}
        for arguments in ({}, {"bag": self.recording.bag}):
            self.assertEqual(segmentation(**arguments), told)
            self.assertEqual(segmentation(method="none", **arguments), {**told, "method": "none"})
            self.assertEqual(segmentation(background_image="/sky.png", **arguments),
                             {**told, "background_image": "/sky.png"})

    def test_a_camera_lives_now_and_a_bag_in_its_own_time(self):
        self.assertIs(load("camera.launch")[0]["/use_sim_time"], False)
        self.assertIs(load("bag.launch", bag=self.recording.bag)[0]["/use_sim_time"], True)

    # As users type them.

    def start(self, name, *arguments, **environment):
        """roslaunch on a free port; what it says, and the environment that finds its master."""
        with socket.socket() as probe:
            probe.bind(("", 0))
            port = str(probe.getsockname()[1])
        environment = {**os.environ, "ROS_MASTER_URI": "http://localhost:" + port, "PYTHONUNBUFFERED": "1",
                       "HOME": self.folder, "ROS_HOME": self.folder + "/ros", "XDG_CACHE_HOME": self.folder + "/cache",
                       "DISPLAY": "", **environment}
        log = tempfile.TemporaryFile(mode="w+")
        process = subprocess.Popen(["roslaunch", "-p", port, "mono_pose_tracker", name, *arguments], stdout=log,
                                   stderr=subprocess.STDOUT, env=environment, start_new_session=True)
        self.addCleanup(log.close)
        self.addCleanup(self.stop, process)

        def said():
            log.flush()
            with open(f"/proc/self/fd/{log.fileno()}") as text:
                return text.read()
        return process, said

    def stop(self, process):
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGINT)
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)

    def run_to_its_end(self, name, *arguments, **environment):
        process, said = self.start(name, *arguments, **environment)
        try:
            process.wait(TIMEOUT)
        except subprocess.TimeoutExpired:
            self.fail(f"{name} does not end by itself; it said:\n{said()}")
        return said()

    def expect(self, name, words, *arguments, **environment):
        """That the log comes to have all the words; then it is ended."""
        process, said = self.start(name, *arguments, **environment)
        deadline = time.monotonic() + TIMEOUT
        while not all(word in said() for word in words):
            if time.monotonic() > deadline or process.poll() is not None:
                self.fail(f"{name} never said {[w for w in words if w not in said()]}, but:\n{said()}")
            time.sleep(0.1)
        self.stop(process)
        self.assertNotIn("Traceback", said())

    def test_bag_with_defaults_ends_with_a_summary(self):
        said = self.run_to_its_end("bag.launch", "bag:=" + self.recording.bag, "rviz:=false")
        self.assertIn("sequence.bag has ended. 12 images: ", said)
        self.assertRegex(said, r"\d+ registered, \d+ dropped, \d+ lost; map \d+ has \d+ keyframes")

    def test_a_tracker_that_is_refused_ends_the_launch(self):
        for name in ("bag.launch", "object.launch"):
            said = self.run_to_its_end(name, "bag:=" + self.recording.bag, "rviz:=false", "map_orientation:=upwards")
            self.assertIn("~map_orientation is upwards, expected ", said)
            self.assertNotIn("has ended. ", said)
        said = self.run_to_its_end("camera.launch", "rviz:=false", "driver:=own", "hfov:=200")
        self.assertIn("~hfov is 200, expected 0 (none) or 5 to 150 degrees", said)

    def test_a_calibration_takes_the_place_of_a_guess(self):
        said = self.run_to_its_end("bag.launch", "bag:=" + self.recording.bag, "rviz:=false", "hfov:=60")
        self.assertIn("a calibration is used: ~hfov is ignored", said)

    def test_a_transport_in_the_name_of_the_images_is_told(self):
        self.expect("tracker.launch", ["image_topic:=), with image_transport:=compressed"],
                    "image_topic:=/camera/image_raw/compressed")

    def test_bag_that_holds_both_kinds_of_images(self):
        said = self.run_to_its_end("bag.launch", "bag:=" + self.recording.both, "rviz:=false")
        self.assertIn("has ended. 12 images: ", said)

    def test_bag_with_every_argument(self):
        """Compressed images only, without the word; relative names; a guess instead of a calibration."""
        trajectory = self.folder + "/live.txt"
        said = self.run_to_its_end(
            "bag.launch", "bag:=" + self.recording.packed, "image_topic:=camera/image_raw", "rviz:=false", "hfov:=60",
            "rate:=2", "queue_size:=50", "map_frame:=field", "map_orientation:=z_up", "camera_info_url:=",
            "rectified:=false", "trajectory_file:=" + trajectory, "map_path:=" + self.folder + "/field.map",
            "config:=" + os.path.join(ROOT, "config", "fast.yaml"), "play_args:=--start=0.05 --duration=100",
            ROS_NAMESPACE="left")
        self.assertIn("image_transport:=compressed", said)
        self.assertRegex(said, r"has ended. 1[01] images: ")
        self.assertIn("written: " + trajectory, said)
        self.assertTrue(os.path.exists(trajectory))

    def test_bag_that_has_not_what_is_asked_for(self):
        said = self.run_to_its_end("bag.launch", "bag:=" + self.recording.packed, "image_topic:=/cam/image", "rviz:=false")
        self.assertIn("has no images on /cam/image", said)
        self.assertIn("/camera/image_raw/compressed", said)
        said = self.run_to_its_end("demo.launch", "rviz:=false", XDG_CACHE_HOME=self.folder + "/no_cache")
        self.assertIn("mono_pose_tracker/demo/sequence.bag: no such file", said)

    def test_what_is_no_bag_ends_the_launch_with_its_cause(self):
        for name, head, words, transport in (
                ("walk.mp4", b"\0\0\0\x20ftypisom", "is a video: camera.launch video:=FILE plays it", "auto"),
                ("drive.mcap", b"\x89MCAP0\r\n", "is an MCAP file: track_sequence --bag tracks it; to play it, convert it", "raw")):
            path = os.path.join(self.folder, name)
            with open(path, "wb") as file:
                file.write(head + bytes(100))
            said = self.run_to_its_end("bag.launch", "bag:=" + path, "rviz:=false", "image_transport:=" + transport)
            self.assertEqual(said.count("play_bag: "), 1, said)
            self.assertIn(f"play_bag: {path}: {words}", said)
            self.assertNotIn("Traceback (most", said)
            self.assertNotIn("process[", said, "nothing is started")

    def test_compressed_images_alone_and_a_guess_give_a_trajectory(self):
        """Live by one command, offline by another; the guess is off by 3 %."""
        folder = self.folder + "/alone"
        recording = Recording(folder, 48, 320)
        with open(recording.camera) as file:
            focal = yaml.safe_load(file)["camera_matrix"]["data"][0]
        hfov = 1.03 * math.degrees(2 * math.atan(160 / focal))
        live, offline = folder + "/live.txt", folder + "/offline"
        said = self.run_to_its_end("bag.launch", "bag:=" + recording.packed, f"hfov:={hfov:.3f}", "rviz:=false",
                                   "trajectory_file:=" + live, "queue_size:=1000")
        self.assertIn("48 images: ", said)
        self.assertIn("the camera is guessed", said)
        subprocess.run([os.path.join(PROGRAMS, "track_sequence"), "--bag", recording.packed, "--hfov", f"{hfov:.3f}",
                        "--output", offline, "--quiet"], check=True)
        for estimate, least in ((live, 24), (offline + "/trajectory.txt", 48)):
            errors = folder + "/errors.json"
            subprocess.run([os.path.join(PROGRAMS, "evaluate_trajectory"), "--reference", recording.truth, "--estimate",
                            estimate, "--json", errors], check=True, stdout=subprocess.DEVNULL)
            with open(errors) as file:
                error = json.load(file)
            self.assertGreaterEqual(error["frames_matched"], least, said)
            self.assertLess(error["position_rmse_percent"], 5)

    def test_object(self):
        said = self.run_to_its_end("object.launch", "bag:=" + self.recording.bag, "rviz:=false", "method:=none",
                                   "object_origin:=centre")
        self.assertIn("has ended. 12 images: ", said)
        self.expect("object.launch", ["no image on /camera/image_raw: nobody publishes it"], "rviz:=false")

    def test_bag_of_an_object_with_defaults(self):
        """A head that turns before a background full of texture, nothing being given."""
        folder = self.folder + "/head"
        subprocess.run([os.path.join(PROGRAMS, "simulate_sequence"), "--output", folder, "--background", "textured",
                        "--frames", "50", "--rate", "8", "--width", "480", "--height", "360", "--quiet"], check=True)
        trajectory = folder + "/live.txt"
        said = self.run_to_its_end("object.launch", "bag:=" + folder + "/sequence.bag", "rviz:=false",
                                   "object_origin:=centre", "trajectory_file:=" + trajectory)
        self.assertIn("has ended. 50 images: ", said)
        with open(trajectory) as file:
            self.assertGreaterEqual(len([line for line in file if not line.startswith("#")]), 25, said)

    def test_demo_with_defaults(self):
        self.assertIn("has ended. 12 images: ", self.run_to_its_end("demo.launch", "rviz:=false"))

    def test_tracker(self):
        self.expect("tracker.launch", ["no image on /camera/image_raw: nobody publishes it"])

    def test_camera(self):
        """Without one, as here, it says so and goes on looking; with a name space and everything else set."""
        self.expect("camera.launch", ["no image on /camera/image_raw although it is published", "/dev/video0"], "rviz:=false", "driver:=own")
        self.expect("camera.launch", ["no image on /left/camera/image_raw although it is published", "/dev/no_such"], "rviz:=false",
                    "driver:=own", "device:=/dev/no_such", "camera_info_url:=" + self.recording.camera, "width:=160",
                    "height:=120", "rate:=10", "frame_id:=left_camera", "map_frame:=left_map", "view_frame:=left_view",
                    "base_frame:=base", "odom_frame:=odom", "map_orientation:=z_up", "hfov:=70", ROS_NAMESPACE="left")

    def test_a_video_that_cannot_be_read_ends_the_launch(self):
        text = self.folder + "/text.avi"
        with open(text, "w") as file:
            file.write("not a video")
        for video, words in ((self.folder + "/no_such.avi", "no such video: %s"), (text, "%s: cannot be opened as a video: expected")):
            said = self.run_to_its_end("camera.launch", "rviz:=false", "video:=" + video)
            self.assertEqual(said.count(words % video), 1, said)
            self.assertNotIn("retrying", said)


if __name__ == "__main__":
    rosunit.unitrun("mono_pose_tracker", "launch_files", LaunchFilesTest, sysargs=sys.argv)
