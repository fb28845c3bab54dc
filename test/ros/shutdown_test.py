#!/usr/bin/python3
"""A tracker ends within two seconds, whatever legal options it has and whatever it is about."""
import itertools
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import roslib.packages
import rospy
import rostest
from nodelet.srv import NodeletLoad, NodeletUnload
from sensor_msgs.msg import Image

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import feeding  # noqa: E402
from background import Stream  # noqa: E402

FRAMES = 24
LIMIT = 2  # s

# Bundle adjustment that never has enough: of all keyframes there are and all they see, by steps without end.
ENDLESS = {"bundle/max_iterations": 10000, "bundle/function_tolerance": 0.0, "bundle/loss_width": 0.0,
           "mapping/bundle_seconds": 1e12, "mapping/window_keyframes": 1000, "mapping/window_landmarks": 1000000,
           "mapping/matching_keyframes": 1000, "mapping/redundant_overlap": 1.01, "mapping/keyframe_parallax_deg": 0.2,
           "sift/first_octave": -1, "sift/max_features": 5000, "sift/contrast_threshold": 0.01}
# All else as much as can be asked for; what begins a map out of noise takes its time.
EXTREME = {**ENDLESS, "max_iterations": 1000000, "confidence": 0.999999999, "sift/contrast_threshold": 0.0,
           "sift/max_features": 1000000, "mapping/keyframe_parallax_deg": 0.0,
           "sift/octave_layers": 10, "sift/edge_threshold": 1000.0, "resection/max_local_keyframes": 1000000,
           "resection/relocalization_keyframes": 1000000, "bootstrap/max_frames": 1000,
           "bootstrap/min_confirmed": 0.0, "bootstrap/min_evidence": 0.0, "matching/min_ratio": 1.0}

WAITING_FOR_TF = {"tf_timeout": 10.0, "base_frame": "nobody_knows_it", "scale/initial_median_depth": 1.0}


class ShutdownTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("shutdown_test")
        cls.folder = tempfile.TemporaryDirectory()
        cls.recording = feeding.Recording(cls.folder.name, FRAMES)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def keep_mapping(self, name):
        """Images until the mapper has been at work on one thing for some of them: the first map or a keyframe of it."""
        camera, tracker = feeding.Camera("/%s_camera" % name, self.recording.info), feeding.Tracker("/" + name)
        busy = 0
        for count, image in enumerate(self.recording.walk()):
            status = camera.show(image, tracker)
            busy = busy + 1 if status.worker_backlog > 0 else 0
            if busy > 5:
                return
            self.assertLess(count, 60, "the mapper is never busy for long: %s" % status.reason_text)

    def keep_busy(self, name):
        """Images faster than they are tracked: one is always under way, and something on the mapper's thread."""
        camera, tracker = feeding.Camera("/%s_camera" % name, self.recording.info), feeding.Tracker("/" + name)
        self.addCleanup(Stream(camera, self.recording.images, 0.02).stop)
        self.assertTrue(tracker.wait_until(lambda: sum(s.reason != TrackerStatus.DROPPED for s in tracker.statuses) > 5))

    def keep_waiting(self, name):
        """Images that displace one another for two seconds, as the one under way waits for what does not come."""
        camera, tracker = feeding.Camera("/%s_camera" % name, self.recording.info), feeding.Tracker("/" + name)
        self.addCleanup(Stream(camera, list(itertools.islice(self.recording.walk(), 1000)), 0.1).stop)
        self.assertTrue(tracker.wait_until(lambda: len(tracker.statuses) > 20 and all(
            s.reason == TrackerStatus.DROPPED for s in tracker.statuses[-20:])))

    def keep_waiting_for_a_mask(self, name):
        masks = rospy.Publisher("/mask", Image, queue_size=1)
        self.addCleanup(masks.unregister)
        feeding.wait_for_connections(masks)
        self.keep_waiting(name)

    def interrupt(self, name, options, keep):
        for key, value in options.items():
            rospy.set_param("/%s/%s" % (name, key), value)
        program = roslib.packages.find_node("mono_pose_tracker", "tracker_node")[0]
        node = subprocess.Popen([program, "__name:=" + name, "image:=/%s_camera/image_raw" % name])
        self.addCleanup(node.wait)
        self.addCleanup(node.kill)
        keep(name)
        begin = time.monotonic()
        node.send_signal(signal.SIGINT)
        self.assertEqual(node.wait(60), 0)
        self.assertLess(time.monotonic() - begin, feeding.SLOWNESS * LIMIT)

    def unload(self, name, options, keep):
        for key, value in options.items():
            rospy.set_param("/%s/%s" % (name, key), value)
        for service in ("/manager/load_nodelet", "/manager/unload_nodelet"):
            rospy.wait_for_service(service, feeding.TIMEOUT)
        load = rospy.ServiceProxy("/manager/load_nodelet", NodeletLoad)
        self.assertTrue(load(name="/" + name, type="mono_pose_tracker/TrackerNodelet", remap_source_args=["image"],
                             remap_target_args=["/%s_camera/image_raw" % name]).success)
        keep(name)
        begin = time.monotonic()
        self.assertTrue(rospy.ServiceProxy("/manager/unload_nodelet", NodeletUnload)(name="/" + name).success)
        self.assertLess(time.monotonic() - begin, feeding.SLOWNESS * LIMIT)

    def test_interrupted_in_the_middle_of_bundle_adjustment(self):
        self.interrupt("interrupted", ENDLESS, self.keep_mapping)

    def test_unloaded_in_the_middle_of_bundle_adjustment(self):
        self.unload("unloaded", ENDLESS, self.keep_mapping)

    def test_interrupted_while_it_waits_for_a_mask(self):
        self.interrupt("interrupted_masked", {"mask_timeout": 10.0}, self.keep_waiting_for_a_mask)

    def test_unloaded_while_it_waits_for_tf(self):
        self.unload("unloaded_based", WAITING_FOR_TF, self.keep_waiting)

    def test_interrupted_with_everything_extreme(self):
        self.interrupt("interrupted_extreme", EXTREME, self.keep_busy)

    def test_unloaded_with_everything_extreme(self):
        self.unload("unloaded_extreme", EXTREME, self.keep_busy)


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "shutdown_test", ShutdownTest)
