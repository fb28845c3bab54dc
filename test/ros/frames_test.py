#!/usr/bin/python3
"""tf, poses and points in each mode of frames, held against where the camera was."""
import itertools
import os
import sys
import tempfile
import unittest

import numpy
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry, Path
from rosgraph_msgs.msg import Log
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from mono_pose_tracker.msg import TrackerStatus

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import feeding  # noqa: E402
import sim3  # noqa: E402
from listening import Listener  # noqa: E402
from transforms import BASE_FROM_CAMERA, matrix, of_pose, of_transform, stamped  # noqa: E402

FRAMES = 30
REGISTERED = 30  # images that every tracker has registered in the end
MODES = ("plain", "z_up", "base", "odom", "inverted", "object", "conflict", "units")

# REP-103: x forward, y left, z up, of optical axes x right, y down, z forward.
Z_UP_FROM_OPTICAL = numpy.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])


def odometry(i):
    """The robot's own idea of its way, which is wrong: odom_from_base at image i."""
    angle = 0.01 * i
    return (0.02 * i, 0.3, 0), (0, 0, numpy.sin(angle / 2), numpy.cos(angle / 2))


class Outputs:
    """What one tracker publishes."""

    def __init__(self, mode):
        self.tracker = feeding.Tracker("/" + mode + "/tracker")
        self.poses, self.odometries, self.latest = {}, {}, {}
        name = self.tracker.name
        self.subscribers = [
            rospy.Subscriber(name + "/pose", PoseWithCovarianceStamped, self.keep(self.poses), queue_size=1000),
            rospy.Subscriber(name + "/odometry", Odometry, self.keep(self.odometries), queue_size=1000)]
        for topic, kind in (("points", PointCloud2), ("path", Path), ("camera_positions", PointCloud2)):
            self.subscribers.append(rospy.Subscriber(name + "/" + topic, kind, self.newest(topic)))
        self.subscribers.append(rospy.Subscriber(name + "/keyframes", MarkerArray, self.newest("keyframes")))
        feeding.wait_for_connections(*self.subscribers)

    @staticmethod
    def keep(messages):
        return lambda m: messages.__setitem__(m.header.stamp.to_nsec(), m)

    def newest(self, topic):
        def take(message):
            with self.tracker.changed:
                self.latest[topic] = message
                self.tracker.changed.notify_all()
        return take


class FramesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("frames_test")
        cls.folder = tempfile.TemporaryDirectory()
        cls.recording = feeding.Recording(cls.folder.name, FRAMES)
        cls.transforms, cls.log = [], []
        cls.subscribers = [
            rospy.Subscriber("/tf", TFMessage, lambda m: cls.transforms.extend(m.transforms), queue_size=1000),
            rospy.Subscriber("/rosout", Log, lambda m: cls.log.append(m.msg), queue_size=1000)]
        cls.outputs = {mode: Outputs(mode) for mode in MODES}
        static = tf2_ros.StaticTransformBroadcaster()
        static.sendTransform(
            [stamped(mode + "_base", mode + "_camera", rospy.Time.now(), *BASE_FROM_CAMERA) for mode in ("base", "odom", "units")] +
            [stamped("conflict_mount", "conflict_camera", rospy.Time.now(), *BASE_FROM_CAMERA)])
        moving = tf2_ros.TransformBroadcaster()
        feeding.wait_for_connections(moving.pub_tf, static.pub_tf)
        camera = feeding.Camera("/camera", cls.recording.info)
        trackers = [o.tracker for o in cls.outputs.values()]
        cls.shown = []
        for i, image in enumerate(cls.recording.walk()):
            moving.sendTransform(stamped("odom_odom", "odom_base", image.header.stamp, *odometry(i)))
            answers = camera.show(image, *trackers)
            cls.shown.append(image.header.stamp)
            if i == 20 * REGISTERED or min(a.frames_posed for a in answers) >= REGISTERED:
                break
        last = cls.shown[-1]
        for output in cls.outputs.values():
            output.tracker.wait_until(
                lambda: {"points", "path", "camera_positions", "keyframes"} <= set(output.latest) and
                output.latest["path"].header.stamp == last)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def of_tf(self, parent, child):
        """{stamp: parent_from_child} of all there was on tf; the child has no other parent there."""
        result = {}
        for t in self.transforms:
            if t.child_frame_id == child:
                self.assertEqual(t.header.frame_id, parent)
                result[t.header.stamp.to_nsec()] = of_transform(t.transform)
        return result

    def expect_true(self, map_from_camera, offset=False):
        """Given in the axes of the first camera (with an offset: of some other origin), the scale being free."""
        self.assertGreaterEqual(len(map_from_camera), REGISTERED)
        self.assertLessEqual(set(map_from_camera), {s.to_nsec() for s in self.shown}, "stamps are those of the images")
        stamps = sorted(map_from_camera)
        truth = {s: matrix(*p) for s, p in self.recording.truth.items()}
        first_from_world = numpy.linalg.inv(truth[min(truth)])
        expected = numpy.array([first_from_world @ truth[s] for s in stamps])
        found = numpy.array([map_from_camera[s] for s in stamps])
        turned = [sim3.angle_deg(f[:3, :3].T @ e[:3, :3]) for f, e in zip(found, expected)]
        self.assertLess(numpy.median(turned), 0.8)  # twice the bound at 640x480, the image being half as large
        a, b = found[:, :3, 3], expected[:, :3, 3]
        if offset:
            a, b = a - a.mean(0), b - b.mean(0)
        scale = (a * b).sum() / (a * a).sum()
        path = numpy.linalg.norm(numpy.diff(expected[:, :3, 3], axis=0), axis=1).sum()
        self.assertLess(numpy.sqrt(((scale * a - b) ** 2).sum(1).mean()), 0.02 * path)

    def expect_poses(self, mode, frame, child, expected):
        """~pose and ~odometry are equal: both are of the tracked frame."""
        output = self.outputs[mode]
        tracked = [s.header.stamp.to_nsec() for s in output.tracker.statuses if s.state == TrackerStatus.TRACKING]
        self.assertEqual(sorted(output.poses), tracked)
        self.assertEqual(sorted(output.odometries), tracked)
        for stamp, pose in output.poses.items():
            odom = output.odometries[stamp]
            self.assertEqual((pose.header.frame_id, odom.header.frame_id, odom.child_frame_id), (frame, frame, child))
            self.assertEqual(pose.pose, odom.pose)
            if stamp in expected:
                numpy.testing.assert_allclose(of_pose(pose.pose.pose), expected[stamp], atol=1e-9)

    def expect_frame_ids(self, mode, world, path):
        latest = self.outputs[mode].latest
        self.assertEqual(latest["points"].header.frame_id, world)
        self.assertEqual(latest["camera_positions"].header.frame_id, world)
        self.assertEqual(latest["keyframes"].markers[0].header.frame_id, world)
        self.assertEqual(latest["path"].header.frame_id, path)

    def positions(self, mode):
        return numpy.array(list(point_cloud2.read_points(self.outputs[mode].latest["camera_positions"], ("x", "y", "z"))))

    def points(self, mode):
        return numpy.array(list(point_cloud2.read_points(self.outputs[mode].latest["points"], ("x", "y", "z"))))

    def test_plain(self):
        found = self.of_tf("plain_map", "camera_optical")
        self.expect_true(found)
        self.expect_poses("plain", "plain_map", "camera_optical", found)
        self.expect_frame_ids("plain", "plain_map", "plain_map")
        self.assertGreater(numpy.median(self.points("plain")[:, 2]), 0, "points lie before the first camera")

    def test_z_up(self):
        found = self.of_tf("z_up_map", "z_up_camera")
        self.expect_true({s: Z_UP_FROM_OPTICAL.T @ m for s, m in found.items()})
        self.expect_poses("z_up", "z_up_map", "z_up_camera", found)
        self.expect_frame_ids("z_up", "z_up_map", "z_up_map")
        self.assertGreater(numpy.median(self.points("z_up")[:, 0]), 0, "points lie ahead of the first camera, x")
        in_order = numpy.array([found[s][:3, 3] for s in sorted(found)])
        numpy.testing.assert_allclose(self.positions("z_up"), in_order, atol=1e-5)
        saved = self.outputs["z_up"].tracker.call("save_trajectory")
        self.assertTrue(saved.success, saved.message)
        path = saved.message.split(" in ")[1]
        self.addCleanup(os.remove, path)
        for stamp, pose in feeding.read_tum(path).items():
            numpy.testing.assert_allclose(matrix(*pose), found[stamp], atol=1e-7)

    def test_base(self):
        found = self.of_tf("base_map", "base_base")
        base_from_camera = matrix(*BASE_FROM_CAMERA)
        self.expect_true({s: Z_UP_FROM_OPTICAL.T @ m @ base_from_camera for s, m in found.items()})
        self.expect_poses("base", "base_map", "base_base", found)
        self.expect_frame_ids("base", "base_map", "base_map")
        in_order = numpy.array([(found[s] @ base_from_camera)[:3, 3] for s in sorted(found)])
        numpy.testing.assert_allclose(self.positions("base"), in_order, atol=1e-5)

    def test_odom(self):
        odom_from_base = {stamp.to_nsec(): matrix(*odometry(i)) for i, stamp in enumerate(self.shown)}
        found = {s: m @ odom_from_base[s] for s, m in self.of_tf("odom_map", "odom_odom").items()
                 if s in odom_from_base}
        again = {s: m for s, m in self.of_tf("odom_map", "odom_odom").items() if s not in odom_from_base}
        self.assertTrue(again, "map -> odom is sent again between the images")
        newest, first_repeats = 0, {}
        for t in self.transforms:
            if t.child_frame_id != "odom_odom":
                continue
            stamp = t.header.stamp.to_nsec()
            if stamp in odom_from_base:
                newest = stamp
            else:
                self.assertGreaterEqual(stamp, newest + 0.1e9 - 1000, "ahead of the newest image by ~tf_tolerance")
                first_repeats.setdefault(newest, stamp)
        # What the image took is part of what has passed since. Medians: a single one may be held up anywhere.
        latency = {s.header.stamp.to_nsec(): 1e6 * s.latency_ms for s in self.outputs["odom"].tracker.statuses}
        passed = numpy.median([stamp - 0.1e9 - image for image, stamp in first_repeats.items()])
        self.assertGreater(passed, 0.9 * numpy.median([latency[image] for image in first_repeats]))
        for map_from_odom in again.values():
            self.assertTrue(any(numpy.allclose(map_from_odom, m @ numpy.linalg.inv(odom_from_base[s]))
                                for s, m in found.items()), "as it was last")
        self.expect_true({s: m @ matrix(*BASE_FROM_CAMERA) for s, m in found.items()})
        self.expect_poses("odom", "odom_map", "odom_base", found)
        self.of_tf("odom_odom", "odom_base")  # odometry's, nobody else's

    def test_map_units_are_not_mixed_with_metres(self):
        """Points and status go on; the log names the ways out."""
        self.assertFalse(self.of_tf("", "units_base"))
        self.assertFalse(self.outputs["units"].poses)
        self.assertGreaterEqual(self.outputs["units"].tracker.statuses[-1].frames_posed, REGISTERED)
        said = [m for m in self.log if "~base_frame is in metres" in m]
        self.assertTrue(said)
        for way_out in ("scale/known_baseline", "scale/initial_median_depth", "scale/marker_size"):
            self.assertIn(way_out, said[0])

    def test_an_unknown_twist_is_one_of_large_variance(self):
        odometries = self.outputs["plain"].odometries
        first = odometries[min(odometries)].twist.covariance
        self.assertGreaterEqual(min(first[7 * i] for i in range(6)), 1e6)
        later = odometries[max(odometries)].twist.covariance
        self.assertGreater(min(later[7 * i] for i in range(6)), 0)
        self.assertLess(max(later[7 * i] for i in range(6)), 1e3)

    def test_inverted(self):
        found = {s: numpy.linalg.inv(m) for s, m in self.of_tf("inverted_camera", "inverted_map").items()}
        self.expect_true(found)
        self.assertFalse(self.of_tf("", "inverted_camera"))
        self.expect_poses("inverted", "inverted_map", "inverted_camera", found)

    def test_object(self):
        camera_from_object = self.of_tf("object_camera", "object_object")
        self.expect_poses("object", "object_camera", "object_object", camera_from_object)
        self.expect_frame_ids("object", "object_object", "object_camera")
        # The origin moves as the map grows: on the path all poses are given about the last one.
        on_path = {p.header.stamp.to_nsec(): of_pose(p.pose) for p in self.outputs["object"].latest["path"].poses}
        self.expect_true({s: numpy.linalg.inv(m) for s, m in on_path.items()}, offset=True)
        # tf as it was reported is that, but for moves of the origin, each of which counts as a correction.
        moved = [numpy.linalg.norm((numpy.linalg.inv(on_path[s]) @ camera_from_object[s])[:3, 3]) for s in sorted(on_path)]
        self.assertLess(moved[-1], 1e-6)
        changes = numpy.count_nonzero(numpy.abs(numpy.diff(moved)) > 1e-3)
        self.assertLessEqual(changes, self.outputs["object"].tracker.statuses[-1].corrections)
        low, high = numpy.percentile(self.points("object"), (5, 95), axis=0)
        # 0.05, and as much again for what may have come into the map since the last image.
        self.assertLess(numpy.linalg.norm(low + high) / 2, 0.1 * (high - low).max())
        low, high = numpy.percentile(self.points("plain"), (5, 95), axis=0)
        self.assertGreater(numpy.linalg.norm(low + high) / 2, 0.5, "in the first camera's frame it is far from the origin")

    def test_a_view_frame_that_is_the_images_is_ignored(self):
        """Below the object it would close a loop with what is asked for: the object below the camera."""
        transforms, log = Listener("/tf", TFMessage), Listener("/rosout", Log)
        tracker, camera = feeding.Tracker("/view/tracker"), feeding.Camera("/viewed_camera", self.recording.info)
        images = itertools.islice(self.recording.walk(), 20 * REGISTERED)
        feeding.track(camera, tracker, (self.of_frame("/view_camera", image) for image in images), 5)
        self.assertIsNotNone(transforms.wait_for(lambda m: any(
            (t.header.frame_id, t.child_frame_id) == ("view_camera", "view_object") for t in m.transforms)))
        self.assertIsNotNone(log.wait_for(lambda m: "view_camera is the images' own frame" in m.msg))
        self.assertFalse(self.of_tf("", "view_camera"))
        self.assertFalse(self.of_tf("", "view_camera_object"), "beside a view frame only")

    @staticmethod
    def of_frame(frame, image):
        image.header.frame_id = frame
        return image

    def test_no_second_parent(self):
        self.assertFalse(self.of_tf("", "conflict_camera"), "its parent is conflict_mount, on tf_static")
        self.expect_poses("conflict", "conflict_map", "conflict_camera", {})
        self.assertGreaterEqual(len(self.outputs["conflict"].poses), REGISTERED)
        self.assertTrue([m for m in self.log if "conflict_camera has the parent conflict_mount already" in m])


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "frames_test", FramesTest)
