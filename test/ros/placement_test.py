#!/usr/bin/python3
"""~initialpose moves the map; scale/odometry makes it metric. The images, and how the robot moves, are simulated."""
import copy
import os
import random
import sys
import tempfile
import unittest

import numpy
import rospy
import rostest
import tf2_ros
from dynamic_reconfigure.msg import BoolParameter, Config
from dynamic_reconfigure.srv import Reconfigure
from geometry_msgs.msg import PoseWithCovarianceStamped
from rosgraph_msgs.msg import Log

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import feeding  # noqa: E402
import sim3  # noqa: E402
from transforms import BASE_FROM_CAMERA, matrix, of_pose, stamped  # noqa: E402

FRAMES = 40
PIECE = 0.15  # m of the camera's way, at the end of which scale/odometry measures; ten may do
MOST_IMAGES = 1000  # until odometry has said enough: some 2 m of way, and a map that begins when the machine has time


def quaternion_of(R):
    """x y z w; the trace is far from -1 for what a walk in a room turns."""
    w = numpy.sqrt(max(0, 1 + numpy.trace(R))) / 2
    return ((R[2, 1] - R[1, 2]) / (4 * w), (R[0, 2] - R[2, 0]) / (4 * w), (R[1, 0] - R[0, 1]) / (4 * w), w)


class Robot:
    """Its odometry: each step is off by 2 % of its length, one standard deviation, and has the camera go `stretch` times as
    far as that."""

    def __init__(self):
        self.random = random.Random(3)
        self.base_from_camera = matrix(*BASE_FROM_CAMERA)
        self.camera_from_base = numpy.linalg.inv(self.base_from_camera)
        self.last = None  # world_from_base
        self.odom_from_base = numpy.eye(4)
        self.stretch = 1.0

    def go(self, world_from_camera):
        world_from_base = world_from_camera @ self.camera_from_base
        if self.last is not None:
            step = numpy.linalg.inv(self.last) @ world_from_base
            step[:3, 3] *= 1 + 0.02 * self.random.gauss(0, 1)
            of_camera = self.camera_from_base @ step @ self.base_from_camera
            of_camera[:3, 3] *= self.stretch
            self.odom_from_base = self.odom_from_base @ self.base_from_camera @ of_camera @ self.camera_from_base
        self.last = world_from_base
        return world_from_base

    def camera_in_odom(self):
        return (self.odom_from_base @ self.base_from_camera)[:3, 3]


class PlacementTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("placement_test")
        cls.folder = tempfile.TemporaryDirectory()
        cls.recording = feeding.Recording(cls.folder.name, FRAMES)
        cls.log, cls.poses = [], {"told": {}, "driven": {}}
        cls.trackers = {name: feeding.Tracker("/" + name + "/tracker") for name in cls.poses}
        cls.initialpose, cls.other_initialpose = (
            rospy.Publisher("/" + name + "/tracker/initialpose", PoseWithCovarianceStamped, queue_size=1)
            for name in cls.poses)
        cls.subscribers = [rospy.Subscriber("/rosout", Log, cls.on_log, queue_size=1000)]
        for name, poses in cls.poses.items():
            cls.subscribers.append(rospy.Subscriber(
                "/" + name + "/tracker/pose", PoseWithCovarianceStamped,
                lambda m, poses=poses: poses.__setitem__(m.header.stamp.to_nsec(), of_pose(m.pose.pose)), queue_size=1000))
        static = tf2_ros.StaticTransformBroadcaster()
        static.sendTransform([stamped(n + "_base", n + "_camera", rospy.Time.now(), *BASE_FROM_CAMERA) for n in cls.poses])
        cls.moving = tf2_ros.TransformBroadcaster()
        feeding.wait_for_connections(cls.moving.pub_tf, static.pub_tf, cls.initialpose, cls.other_initialpose,
                                     *cls.subscribers)
        cls.camera = feeding.Camera("/camera", cls.recording.info)
        cls.images, cls.robot, cls.bases, cls.in_units = cls.recording.walk(), Robot(), {}, []

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def on_log(cls, message):
        with cls.trackers["told"].changed:
            cls.log.append(message.msg)
            cls.trackers["told"].changed.notify_all()

    def show(self, with_odometry=True):
        """The trackers' answers, by name, to the next image."""
        image = next(self.images)
        stamp = image.header.stamp
        self.bases[stamp.to_nsec()] = self.robot.go(matrix(*self.recording.truth[stamp.to_nsec()]))
        odom_from_base = self.robot.odom_from_base
        if with_odometry:
            self.moving.sendTransform(stamped("driven_odom", "driven_base", stamp, odom_from_base[:3, 3],
                                              quaternion_of(odom_from_base[:3, :3])))
        answers = dict(zip(self.trackers, self.camera.show(image, *self.trackers.values())))
        if answers["driven"].scale == TrackerStatus.MAP_UNITS:
            self.in_units.append(stamp.to_nsec())
        return answers

    def show_until(self, done):
        for _ in range(MOST_IMAGES):
            answers = self.show()
            if done(answers):
                return answers
        self.fail("never: " + str(answers))

    def pose_of(self, name, stamp):
        """~pose comes just before ~status."""
        self.assertTrue(self.trackers[name].wait_until(lambda: stamp.to_nsec() in self.poses[name], 5))
        return self.poses[name][stamp.to_nsec()]

    def test_a_map_in_units_has_no_place_in_metres(self):
        self.show_until(lambda a: a["driven"].state == TrackerStatus.TRACKING)
        wanted = PoseWithCovarianceStamped()
        wanted.header.frame_id, wanted.pose.pose.orientation.w = "driven_map", 1
        self.other_initialpose.publish(wanted)
        answer = self.show_until(lambda a: any("can't be placed in metres" in m for m in self.log))["driven"]
        self.assertEqual((answer.scale, answer.corrections), (TrackerStatus.MAP_UNITS, 0))

    def test_a_refused_image_is_no_other_map(self):
        """Odometry's scale would be measured anew from there."""
        before = self.show_until(lambda a: a["driven"].state == TrackerStatus.TRACKING)["driven"]
        image = next(self.images)
        image.encoding = "no_such_encoding"
        refused = dict(zip(self.trackers, self.camera.show(image, *self.trackers.values())))["driven"]
        self.assertEqual(refused.reason, TrackerStatus.UNSUPPORTED_ENCODING)
        self.assertGreater(refused.map_id, 0)
        for said in ("state", "epoch", "map_id", "corrections", "scale", "keyframes", "landmarks"):
            self.assertEqual(getattr(refused, said), getattr(before, said), said)

    def answer_to_initialpose(self):
        before = len(self.log)
        wanted = PoseWithCovarianceStamped()
        wanted.header.frame_id, wanted.pose.pose.orientation.w = "told_map", 1
        self.initialpose.publish(wanted)
        answer = lambda: next((m for m in self.log[before:] if "~initialpose: " in m), None)  # noqa: E731
        self.assertTrue(self.trackers["told"].wait_until(answer))
        return answer()

    def test_only_a_present_pose_is_replaced(self):
        """Not that of another map, nor one from before a pause: the robot may have driven on."""
        tracker = self.trackers["told"]
        rospy.set_param("/told/tracker/map_path", os.path.join(self.folder.name, "told.map"))
        is_tracking = lambda a: a["told"].state == TrackerStatus.TRACKING  # noqa: E731
        for service in ("load_map", "reset"):
            self.show_until(is_tracking)
            self.assertTrue(tracker.call("save_map").success)
            self.assertTrue(tracker.call(service).success)
            self.assertIn("there is no present pose", self.answer_to_initialpose(), service)
        self.show_until(is_tracking)
        self.assertTrue(tracker.call("pause").success)
        self.assertIn("paused: there is no present pose", self.answer_to_initialpose())
        self.assertTrue(tracker.call("resume").success)
        self.assertIn("there is no present pose", self.answer_to_initialpose())
        self.show_until(is_tracking)
        self.assertIn("the map is moved", self.answer_to_initialpose())

    def test_initialpose_places_the_base(self):
        is_tracking = lambda a: a["told"].state == TrackerStatus.TRACKING  # noqa: E731
        before = self.show_until(is_tracking)["told"]
        found = self.pose_of("told", before.header.stamp)
        wanted = PoseWithCovarianceStamped()
        wanted.header.frame_id = "elsewhere"
        wanted.pose.pose.position.x, wanted.pose.pose.position.y, wanted.pose.pose.position.z = 4, -3, 0.5
        wanted.pose.pose.orientation.z = wanted.pose.pose.orientation.w = numpy.sqrt(0.5)
        self.initialpose.publish(wanted)
        self.show_until(lambda a: any("expected told_map" in m for m in self.log))
        self.assertEqual(self.trackers["told"].statuses[-1].corrections, 0, "of another frame: refused")
        far = copy.deepcopy(wanted)
        far.header.frame_id, far.pose.pose.position.x = "told_map", 1e12
        self.initialpose.publish(far)
        self.show_until(lambda a: any("~initialpose: it is 1e+12 from the origin" in m for m in self.log))
        self.assertEqual(self.trackers["told"].statuses[-1].corrections, 0, "beyond what doubles are fine enough for")

        before = self.show_until(is_tracking)["told"]
        found = self.pose_of("told", before.header.stamp)
        wanted.header.frame_id = "told_map"
        first = copy.deepcopy(wanted)  # thought better of before the next image shows it
        first.pose.pose.position.x, first.pose.pose.orientation.w = 40, 0.9
        first.pose.pose.orientation.z = numpy.sqrt(1 - 0.81)
        for count, pose in ((1, first), (2, wanted)):
            self.initialpose.publish(pose)
            self.assertTrue(self.trackers["told"].wait_until(
                lambda count=count: sum("the map is moved" in m for m in self.log) >= count))
        # An image that comes between the two shows the first.
        after = self.show_until(lambda a: is_tracking(a) and a["told"].corrections > before.corrections
                                and self.pose_of("told", a["told"].header.stamp)[0, 3] < 20)["told"]
        self.assertEqual(after.map_id, before.map_id)
        # The pose that was replaced may be one or two images newer than the one that was seen last: what moved
        # the map must be what takes one of those to where it was wanted.
        moved = self.pose_of("told", after.header.stamp)
        true_step = numpy.linalg.inv(self.bases[before.header.stamp.to_nsec()]) @ self.bases[after.header.stamp.to_nsec()]
        self.assertGreater(numpy.linalg.norm(found[:3, 3] - moved[:3, 3]), 2)
        self.assertLess(numpy.linalg.norm(moved[:3, 3] - (4, -3, 0.5)), 0.1 + 2 * numpy.linalg.norm(true_step[:3, 3]))
        turned = sim3.angle_deg(moved[:3, :3].T @ matrix((0, 0, 0), (0, 0, numpy.sqrt(0.5), numpy.sqrt(0.5)))[:3, :3])
        self.assertLess(turned, 2 + 2 * sim3.angle_deg(true_step[:3, :3]))

    def test_odometry_gives_metres(self):
        self.show_until(lambda a: a["driven"].scale == TrackerStatus.ODOMETRY)
        stamps = []
        while len(stamps) < 2 * FRAMES:
            answer = self.show()["driven"]
            if answer.state == TrackerStatus.TRACKING and answer.scale == TrackerStatus.ODOMETRY:
                stamps.append(answer.header.stamp)
        found = numpy.array([self.pose_of("driven", s)[:3, 3] for s in stamps])
        expected = numpy.array([self.bases[s.to_nsec()][:3, 3] for s in stamps])
        spread = [numpy.sqrt(((p - p.mean(0)) ** 2).sum()) for p in (found, expected)]
        self.assertAlmostEqual(spread[0] / spread[1], 1, delta=0.02)
        self.assertEqual(len([m for m in self.log if "scale/odometry: one map unit is" in m]), 1, "rescaled once")
        self.assertGreater(len(self.in_units), 5)
        self.assertFalse(set(self.in_units) & set(self.poses["driven"]), "published in units of the map")

    def test_odometry_that_stops_is_waited_for_once(self):
        """Not for the scale and for tf, one after the other."""
        self.show_until(lambda a: a["driven"].state == TrackerStatus.TRACKING and
                        a["driven"].scale == TrackerStatus.ODOMETRY)
        answer = self.show(with_odometry=False)["driven"]
        self.assertEqual(answer.state, TrackerStatus.TRACKING)
        timeout_ms = 1e3 * rospy.get_param("/driven/tracker/tf_timeout")
        self.assertGreaterEqual(answer.latency_ms, timeout_ms)
        self.assertLess(answer.latency_ms, 1.9 * timeout_ms)

    def set_localize_only(self, value):
        service = "/driven/tracker/set_parameters"
        rospy.wait_for_service(service, feeding.TIMEOUT)
        rospy.ServiceProxy(service, Reconfigure)(Config(bools=[BoolParameter("localize_only", value)]))

    def drive(self, pieces):
        """Until odometry has said something of so many pieces of the way."""
        begin = None

        def has_gone(answers):
            nonlocal begin, pieces
            here = self.robot.camera_in_odom()
            if begin is None or answers["driven"].state != TrackerStatus.TRACKING:
                begin = here
            elif numpy.linalg.norm(here - begin) >= PIECE:
                begin, pieces = here, pieces - 1
            return pieces == 0
        return self.show_until(has_gone)["driven"]

    def test_with_localize_only_a_map_in_metres_stays_as_it_is(self):
        """Whatever odometry says: that it is a tenth longer is taken up as soon as localize_only is off."""
        is_metric = lambda a: (a["driven"].state == TrackerStatus.TRACKING and  # noqa: E731
                               a["driven"].scale == TrackerStatus.ODOMETRY)
        self.show_until(is_metric)
        rospy.set_param("/driven/tracker/map_path", os.path.join(self.folder.name, "driven.map"))
        self.set_localize_only(True)
        self.addCleanup(self.set_localize_only, False)
        for service in ("save_map", "load_map"):
            answer = self.trackers["driven"].call(service)
            self.assertTrue(answer.success, answer.message)
        self.addCleanup(setattr, self.robot, "stretch", self.robot.stretch)
        self.robot.stretch = 1.1
        found = self.show_until(is_metric)["driven"]
        after = self.drive(15)
        self.assertEqual((after.map_id, after.corrections), (found.map_id, found.corrections))
        self.set_localize_only(False)
        before, words = len(self.log), "scale/odometry: one map unit is "
        self.show_until(lambda a: any(words in m for m in self.log[before:]))
        said = next(m for m in self.log[before:] if words in m)
        self.assertAlmostEqual(float(said.split(words)[1].split()[0]), 1.1, delta=0.04)


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "placement_test", PlacementTest)
