#!/usr/bin/python3
"""Trackers that are loaded and unloaded, flooded, not listened to, killed, given clocks of every kind or a full disk."""
import math
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import roslib.packages
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from nodelet.srv import NodeletLoad, NodeletUnload
from sensor_msgs.msg import Image

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import feeding  # noqa: E402
import processes  # noqa: E402
from background import Stream  # noqa: E402
from listening import Listener  # noqa: E402

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import reported_skips  # noqa: E402, F401

FRAMES = 24
SHUTDOWN = 5 * feeding.SLOWNESS  # s, for a node that has nothing long under way, on a busy machine


class FaultsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("faults_test")
        cls.folder = tempfile.TemporaryDirectory()
        cls.recording = feeding.Recording(cls.folder.name, FRAMES)
        rospy.wait_for_service("/manager/load_nodelet", feeding.TIMEOUT)
        cls.load_nodelet = rospy.ServiceProxy("/manager/load_nodelet", NodeletLoad)
        cls.unload_nodelet = rospy.ServiceProxy("/manager/unload_nodelet", NodeletUnload)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def load(self, name, camera):
        """Into the manager, without the program `nodelet`: its bond is not what is tested here."""
        answer = self.load_nodelet(name="/" + name, type="mono_pose_tracker/TrackerNodelet",
                                   remap_source_args=["image"], remap_target_args=[camera + "/image_raw"])
        self.assertTrue(answer.success)

    def unload(self, name):
        self.assertTrue(self.unload_nodelet(name="/" + name).success)

    def start(self, name, camera, *arguments, prefix=()):
        """A node of its own; killed at the test's end."""
        program = roslib.packages.find_node("mono_pose_tracker", "tracker_node")[0]
        node = subprocess.Popen([*prefix, program, "__name:=" + name, "image:=" + camera + "/image_raw", *arguments],
                                cwd=self.folder.name)
        self.addCleanup(node.wait)
        self.addCleanup(node.kill)
        return node

    def stream(self, camera, period):
        stream = Stream(camera, self.recording.images, period)
        self.addCleanup(stream.stop)
        return stream

    def test_loaded_and_unloaded_50_times_while_images_come(self):
        stream, before = None, None
        for cycle in range(50):
            self.load("cycled", "/cycled_camera")
            if stream is None:
                stream = self.stream(feeding.Camera("/cycled_camera", self.recording.info), 0.02)
            tracker = feeding.Tracker("/cycled")
            if cycle % 10 == 0:  # else it is unloaded at whatever it does just then
                self.assertTrue(tracker.wait_until(lambda: tracker.statuses), "it answers images")
            self.unload("cycled")
            tracker.subscriber.unregister()
            self.assertEqual(processes.left_below("/cycled/"), [], "nothing of it is left, cycle %d" % cycle)
            if cycle == 9:
                manager = processes.pid_of_node("/manager")
                before = processes.number_of_threads(manager), processes.number_of_handles(manager)
        after = processes.number_of_threads(manager), processes.number_of_handles(manager)
        # Connections close a moment after their topics: a few may still be about.
        self.assertLess(after[0] - before[0], 10, "threads")
        self.assertLess(after[1] - before[1], 20, "open files and sockets")

    def test_what_cannot_be_loaded_leaves_the_others_alone(self):
        self.load("good", "/good_camera")
        self.addCleanup(self.unload, "good")
        camera, tracker = feeding.Camera("/good_camera", self.recording.info), feeding.Tracker("/good")
        rospy.set_param("/bad", {"load_map_at_start": True, "map_path": "/no/such.map"})
        self.addCleanup(rospy.delete_param, "/bad")
        with self.assertRaises(rospy.ServiceException):
            self.load_nodelet(name="/bad", type="mono_pose_tracker/TrackerNodelet", remap_source_args=["image"],
                              remap_target_args=["/good_camera/image_raw"])
        self.assertEqual(processes.left_below("/bad/"), [], "nothing of it is left")
        camera.show(self.recording.images[0], tracker)  # answered

    def test_two_trackers_in_one_manager_under_a_flood(self):
        for name in ("flooded_a", "flooded_b"):
            self.load(name, "/flooded_camera")
            self.addCleanup(self.unload, name)
        camera = feeding.Camera("/flooded_camera", self.recording.info)
        trackers = [feeding.Tracker("/flooded_a"), feeding.Tracker("/flooded_b")]
        # 200 Hz, and as much less as the build is slower: where the whole program stalls, roscpp throws images away
        # before anybody could answer.
        stream = self.stream(camera, 0.005 * feeding.SLOWNESS)
        for tracker in trackers:
            self.assertTrue(tracker.wait_until(lambda: len(tracker.statuses) >= 300))
        stream.stop()
        for tracker in trackers:
            self.assertTrue(tracker.wait_until(lambda: len(tracker.statuses) >= stream.sent), "every image is answered")
            self.assertEqual(len(tracker.statuses), stream.sent)
            dropped = sum(s.reason == TrackerStatus.DROPPED for s in tracker.statuses)
            self.assertEqual(max(s.frames_dropped for s in tracker.statuses), dropped)
            self.assertLess(dropped, stream.sent, "the newest image is never displaced")

    def test_a_subscriber_that_stalls(self):
        """Nobody else waits for it: pictures that it does not take are dropped."""
        self.start("stalled", "/stalled_camera")
        camera, tracker = feeding.Camera("/stalled_camera", self.recording.info), feeding.Tracker("/stalled")
        hold, held = threading.Event(), threading.Event()
        self.addCleanup(hold.set)

        def stall(_):
            held.set()
            hold.wait(feeding.TIMEOUT)

        subscriber = rospy.Subscriber("/stalled/debug_image", Image, stall, queue_size=1)
        feeding.wait_for_connections(subscriber)
        # 100 pictures of 230 kB are more than all buffers on the way hold.
        images = self.recording.walk()
        answers = [camera.show(next(images), tracker) for _ in range(100)]
        self.assertTrue(held.is_set(), "pictures came at first")
        self.assertEqual(sum(s.reason == TrackerStatus.DROPPED for s in answers), 0)
        self.assertEqual(answers[-1].state, TrackerStatus.TRACKING, answers[-1].reason_text)

    def test_stamps_of_every_kind(self):
        self.start("clocks", "/clocks_camera")
        camera, tracker = feeding.Camera("/clocks_camera", self.recording.info), feeding.Tracker("/clocks")
        image = feeding.moved(self.recording.images[0], 0)
        for secs, nsecs in ((0, 0), (0, 0), (1, 0), (2**32 - 1, 999999999), (0, 1), (2**31, 0), (2**31 - 1, 999999999),
                            (5, 2**32 - 1), (1000, 0), (999, 999999999), (1000, 1)):
            # Not by rospy.Time: it puts in order what a careless driver sends.
            image.header.stamp.secs, image.header.stamp.nsecs = secs, nsecs
            self.assertEqual(camera.show(image, tracker).header.stamp.to_nsec(), secs * 10**9 + nsecs)
        last = [camera.show(feeding.moved(i, 2000), tracker) for i in self.recording.images[:3]][-1]
        self.assertIn(last.state, (TrackerStatus.BOOTSTRAPPING, TrackerStatus.TRACKING), last.reason_text)

    def test_nan_by_dynamic_reconfigure_and_a_restart(self):
        """It is refused, and leaves nothing on the parameter server that the next node of this name would stumble over."""
        node = self.start("changed", "/changed_camera")
        camera, tracker = feeding.Camera("/changed_camera", self.recording.info), feeding.Tracker("/changed")
        service = "/changed/set_parameters"
        rospy.wait_for_service(service, feeding.TIMEOUT)
        wrong = [DoubleParameter("mapping/keyframe_overlap", float("nan")),
                 DoubleParameter("publish_period", float("inf")), DoubleParameter("inlier_threshold_px", -float("inf"))]
        for parameter in wrong:
            answer = rospy.ServiceProxy(service, Reconfigure)(Config(doubles=[parameter])).config
            in_force = {p.name: p.value for p in answer.doubles}
            self.assertTrue(math.isfinite(in_force[parameter.name]), parameter)
            on_server = rospy.get_param("/changed/" + parameter.name)
            self.assertTrue(math.isfinite(on_server), "%s on the parameter server" % parameter)
        images = self.recording.walk()
        feeding.track(camera, tracker, images, 3)
        node.send_signal(signal.SIGINT)
        self.assertEqual(node.wait(SHUTDOWN), 0)
        tracker.subscriber.unregister()
        self.start("changed", "/changed_camera")
        tracker = feeding.Tracker("/changed")
        feeding.wait_for_connections(camera.images, camera.infos)
        feeding.track(camera, tracker, images, 3)

    def test_killed_and_started_again_in_its_map(self):
        path = os.path.join(self.folder.name, "kept.map")
        node = self.start("reborn", "/reborn_camera", "_map_path:=" + path)
        camera, tracker = feeding.Camera("/reborn_camera", self.recording.info), feeding.Tracker("/reborn")
        images = self.recording.walk()
        feeding.track(camera, tracker, images, 8)
        saved = tracker.call("save_map")
        self.assertTrue(saved.success, saved.message)
        feeding.track(camera, tracker, images, 2)
        node.send_signal(signal.SIGKILL)
        node.wait()
        tracker.subscriber.unregister()
        self.start("reborn", "/reborn_camera", "_map_path:=" + path)
        tracker = feeding.Tracker("/reborn")
        feeding.wait_for_connections(camera.images, camera.infos)
        # The calibration comes with the images; a map can be loaded from then on.
        deadline = time.monotonic() + feeding.TIMEOUT
        loaded = None
        while loaded is None or not loaded.success:
            self.assertLess(time.monotonic(), deadline, loaded)
            camera.show(next(images), tracker)
            loaded = tracker.call("load_map")
        feeding.track(camera, tracker, images, 3)

    def test_a_disk_that_is_full_and_freed(self):
        """The trajectory file holds whole lines only, and goes on when there is room again; nothing else waits for it."""
        disk = os.path.join(self.folder.name, "disk")
        os.mkdir(disk)
        in_small_disk = ("unshare", "--mount", *([] if os.geteuid() == 0 else ["--map-root-user"]), "sh", "-c",
                         'mount -t tmpfs -o size=16k tmpfs "$0" && head -c 16k /dev/zero >"$0/filler"; exec "$@"', disk)
        if subprocess.run([*in_small_disk, "test", "-s", disk + "/filler"]).returncode:
            self.skipTest("no disk can be mounted here")
        node = self.start("full", "/full_camera", "_trajectory_file:=" + disk + "/trajectory.txt", prefix=in_small_disk)
        camera, tracker = feeding.Camera("/full_camera", self.recording.info), feeding.Tracker("/full")
        drawn, diagnostics = Listener("/full/debug_image", Image), Listener("/diagnostics", DiagnosticArray)
        feeding.wait_for_connections(drawn.subscriber, diagnostics.subscriber)
        images = self.recording.walk()
        registered = [s.header.stamp for s in feeding.track(camera, tracker, images, 5) if s.state == TrackerStatus.TRACKING]
        self.assertIsNotNone(drawn.wait_for(lambda image: image.header.stamp in registered), "no picture while it is full")
        self.assertEqual(self.output_told(diagnostics, "/full", lambda text: "trajectory.txt" in text), DiagnosticStatus.WARN)
        seen_from_here = "/proc/%d/root%s" % (node.pid, disk)
        os.remove(seen_from_here + "/filler")
        registered = [s for s in feeding.track(camera, tracker, images, 10) if s.state == TrackerStatus.TRACKING]
        trajectory = feeding.read_tum(seen_from_here + "/trajectory.txt")
        # The status leaves before its line is written: the last one may be missing.
        stamps = {s.header.stamp.to_nsec() for s in registered[1:-1]}
        self.assertLessEqual(stamps, set(trajectory), "registered after there was room again")
        self.output_told(diagnostics, "/full", lambda text: text == "all is written")

    def output_told(self, diagnostics, node, meets):
        """The level at which /diagnostics next say of what the node writes what is expected."""
        def told(array):
            return next((s for s in array.status if node[1:] in s.name and
                         any(v.key == "output" and meets(v.value) for v in s.values)), None)
        array = diagnostics.wait_for(told, start=len(diagnostics.messages))
        self.assertIsNotNone(array, "it was never said on /diagnostics")
        return told(array).level

    def test_interrupted_while_images_come(self):
        node = self.start("interrupted", "/interrupted_camera")
        camera, tracker = feeding.Camera("/interrupted_camera", self.recording.info), feeding.Tracker("/interrupted")
        feeding.track(camera, tracker, self.recording.walk(), 5)
        camera.info = self.recording.info
        self.stream(camera, 0.005)
        count = len(tracker.statuses)
        self.assertTrue(tracker.wait_until(lambda: len(tracker.statuses) > count))
        node.send_signal(signal.SIGINT)
        self.assertEqual(node.wait(SHUTDOWN), 0)


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "faults_test", FaultsTest)
