#!/usr/bin/python3
"""The floors of the code: a folder includes only folders on lower floors (or itself), and the core no ROS header."""
import pathlib
import re
import sys
import unittest

import rosunit

PACKAGE = "mono_pose_tracker"
REPOSITORY = pathlib.Path(__file__).resolve().parent.parent

FLOORS = [
    ["common"],
    ["camera", "geometry"],
    ["robust", "features", "segmentation"],
    ["map"],
    ["optimization", "io"],
    ["mapping"],
    ["quality"],
    ["tracking"],
    ["pipeline"],
    ["simulation", "evaluation", "ros"],
    ["tools", "python"],
    ["benchmarks"],
]
FLOOR_OF = {folder: floor for floor, folders in enumerate(FLOORS) for folder in folders}
WITH_ROS = {"ros", "tools", "benchmarks"}

# Headers of ROS start with the name of a package; these are what the shell uses or might use.
ROS_HEADER = re.compile(
    r"(ros|rosbag|tf2?|tf2_\w+|nodelet|pluginlib|class_loader|cv_bridge|image_transport|image_geometry|\w+_msgs|std_srvs|"
    r"camera_\w+|diagnostic_updater|dynamic_reconfigure|message_filters|pcl_conversions|mono_pose_tracker)/")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)


def breaches(folder, text):
    """What a file of this folder includes and may not."""
    found = []
    for bracket, header in INCLUDE.findall(text):
        parts = header.split("/")
        if parts[0] == PACKAGE and len(parts) > 2:
            parts = parts[1:]
        elif bracket == "<" or len(parts) < 2 or parts[0] == ".." or (REPOSITORY / "src" / folder / parts[0]).is_dir():
            parts = [None]
        ours = parts[0] in FLOOR_OF
        if parts[0] and not ours:
            found.append(f"{header}: folder {parts[0]} stands on no floor")
        elif ours and parts[0] != folder and FLOOR_OF[parts[0]] >= FLOOR_OF[folder]:
            found.append(f"{header}: {folder} may include only lower floors")
        elif not ours and folder not in WITH_ROS and ROS_HEADER.match(header):
            found.append(f"{header}: the core sees no ROS header")
    return found


def source_files():
    """(folder, path) of every source file of the package."""
    for top in (REPOSITORY / "include" / PACKAGE, REPOSITORY / "src"):
        for path in sorted(top.rglob("*")):
            if path.suffix in (".h", ".cpp"):
                yield path.relative_to(top).parts[0], path


class LayersTest(unittest.TestCase):
    def test_public_headers_are_few_and_include_no_private_one(self):
        public = [path for _, path in source_files() if (REPOSITORY / "include") in path.parents]
        self.assertLessEqual(len(public), 35)
        for path in public:
            private = [header for bracket, header in INCLUDE.findall(path.read_text())
                       if bracket == '"' and not header.startswith(PACKAGE + "/")]
            self.assertFalse(private, path)

    def test_every_folder_stands_on_a_floor(self):
        unknown = {folder for folder, _ in source_files()} - set(FLOOR_OF)
        self.assertFalse(unknown, "folders without a floor")

    def test_files_include_only_lower_floors(self):
        self.assertGreater(len(list(source_files())), 0)
        found = [f"{path.relative_to(REPOSITORY)}: {breach}" for folder, path in source_files() if folder in FLOOR_OF
                 for breach in breaches(folder, path.read_text())]
        self.assertFalse(found, "\n" + "\n".join(found))

    def test_clones_for_processors_are_made_by_the_macro_only(self):
        """Sanitizer builds crash while they are loaded where one is not left out."""
        found = [str(path) for _, path in source_files()
                 if "target_clones" in path.read_text() and path.name != "toolchain.h"]
        self.assertFalse(found)

    def test_a_breach_is_found(self):
        self.assertTrue(breaches("geometry", f'#include "{PACKAGE}/robust/relative_pose.h"'))
        self.assertTrue(breaches("geometry", f'#include "{PACKAGE}/camera/camera_model.h"'))
        self.assertTrue(breaches("geometry", '#include "robust/sampler.h"'))
        self.assertTrue(breaches("tracking", '#include "cellar/sampler.h"'))
        self.assertTrue(breaches("tracking", "#include <ros/ros.h>"))
        self.assertTrue(breaches("io", f"#include <{PACKAGE}/TrackerStatus.h>"))
        self.assertFalse(breaches("robust", f'#include "{PACKAGE}/geometry/p3p.h"'))
        self.assertFalse(breaches("ros", "#include <ros/ros.h>"))


if __name__ == "__main__":
    rosunit.unitrun(PACKAGE, "check_layers", LayersTest, sysargs=sys.argv)
