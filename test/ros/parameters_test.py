#!/usr/bin/python3
"""Parameters that can't be used stop the node at once, and all of them are told."""
import os
import subprocess
import sys
import tempfile
import unittest

import roslib.packages
import rospy
import rostest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from listening import TIMEOUT  # noqa: E402


class ParametersTest(unittest.TestCase):
    def refusal(self, *parameters):
        """What the node says when it refuses these parameters."""
        if rospy.has_param("/tracker"):  # of the call before
            rospy.delete_param("/tracker")
        node = roslib.packages.find_node("mono_pose_tracker", "tracker_node")[0]
        result = subprocess.run([node, *parameters], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                timeout=TIMEOUT)
        self.assertEqual(result.returncode, 1)
        return result.stdout

    def setUp(self):
        if rospy.has_param("/tracker"):
            rospy.delete_param("/tracker")

    def test_all_values_out_of_range_are_named(self):
        said = self.refusal("_queue_size:=0", "_sift/max_features:=-5")
        self.assertIn("~queue_size is 0, not in [1, ", said)
        self.assertIn("~sift/max_features is -5, expected a whole number", said)

    def test_a_value_of_another_type_is_named(self):
        self.assertIn("~publish_tf is not true or false", self.refusal("_publish_tf:=perhaps"))

    def test_the_file_that_alone_is_to_count_must_be_given(self):
        self.assertIn("~camera_info_source is file: expected ~camera_info_url", self.refusal("_camera_info_source:=file"))
        self.assertIn("~camera_info_source is", self.refusal("_camera_info_source:=driver"))

    def test_a_missing_calibration_file_is_named(self):
        self.assertIn("/no/such/camera.yaml", self.refusal("_camera_info_url:=/no/such/camera.yaml"))

    def test_what_is_refused_after_publishers_are_there_ends_it_in_order(self):
        """Exit status 1 and a line, where the nodelet's publishers outlived its queue: a crash."""
        self.assertIn("/no/such.map: cannot be read",
                      self.refusal("_load_map_at_start:=true", "_map_path:=/no/such.map"))
        self.assertIn("nonsense", self.refusal("_image_transport:=nonsense"))
        self.assertIn("segmentation/background_image = /no/such.png",
                      self.refusal("_segmentation/method:=background", "_segmentation/background_image:=/no/such.png"))

    def test_a_name_on_the_command_line_that_is_none(self):
        node = roslib.packages.find_node("mono_pose_tracker", "tracker_node")[0]
        result = subprocess.run([node, "mask:=/x y"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                timeout=TIMEOUT)
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn("/x y", result.stdout)

    def test_frames_with_two_parents_are_refused(self):
        said = self.refusal("_odom_frame:=odom", "_invert_tf:=true")
        self.assertIn("~odom_frame and ~invert_tf", said)
        said = self.refusal("_odom_frame:=odom", "_object_mode:=true", "_map_orientation:=sideways")
        self.assertIn("~odom_frame and ~object_mode", said)
        self.assertIn("~map_orientation is sideways, expected one of optical z_up", said)
        self.assertIn('~base_frame and ~map_frame are both "world"',
                      self.refusal("_map_frame:=/world", "_base_frame:=world"))
        self.assertIn("~object_origin is centre: this needs ~object_mode", self.refusal("_object_origin:=centre"))

    def test_a_view_frame_that_is_the_objects_is_refused(self):
        said = self.refusal("_object_mode:=true", "_object_frame:=v_object", "_view_frame:=/v")
        self.assertIn('~view_frame with the suffix _object and ~object_frame are both "v_object"', said)

    def test_a_map_is_not_written_over_by_the_trajectory(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "kept.map")
            with open(path, "w") as file:
                file.write("a map")
            said = self.refusal("_map_path:=" + path, "_trajectory_file:=" + folder + "/./kept.map",
                                "_load_map_at_start:=true")
            self.assertIn("~map_path and ~trajectory_file are the same file", said)
            with open(path) as file:
                self.assertEqual(file.read(), "a map")

    def test_an_unknown_key_is_answered_by_the_nearest(self):
        said = self.refusal("_camera_frme:=lens", "_camera_info_url:=/no/such/camera.yaml")
        self.assertIn("~camera_frme is not a parameter of the tracker; did you mean ~camera_frame?", said)

    def test_what_is_wrong_and_what_is_unknown_are_named_at_once(self):
        said = self.refusal("_hfov:=3", "_camera_frme:=lens", "_quite_another_thing:=1")
        self.assertIn("~hfov is 3, expected 0 (none) or 5 to 150 degrees; ~camera_frme is not a parameter", said)
        self.assertIn("~quite_another_thing is not a parameter of the tracker", said)
        self.assertNotIn("~quite_another_thing is not a parameter of the tracker; did you mean", said)

    def test_what_the_plugins_of_image_transport_read_is_known(self):
        said = self.refusal("_mask/compressed/format:=png", "_debug_image/compressed/jpeg_quality:=50",
                            "_compressed/mode:=gray", "_compressedDepth/x:=1", "_theora/post_processing_level:=1",
                            "_compresed/mode:=gray", "_camera_info_url:=/no/such/camera.yaml")
        unknown = [line for line in said.splitlines() if "is not a parameter" in line]
        self.assertEqual(len(unknown), 1, said)
        self.assertIn("~compresed/mode is not a parameter of the tracker", unknown[0])

    def test_the_effective_set_is_printed_once(self):
        said = self.refusal("_sift/max_features:=900", "_camera_info_url:=/no/such/camera.yaml")
        lines = [line for line in said.splitlines() if "parameters: " in line]
        self.assertEqual(len(lines), 1, said)
        for value in ("sift/max_features: 900", "sift/min_features: 800", "publish_tf: true", "map_frame: map"):
            self.assertIn(value, lines[0])


if __name__ == "__main__":
    rostest.rosrun("mono_pose_tracker", "parameters_test", ParametersTest)
