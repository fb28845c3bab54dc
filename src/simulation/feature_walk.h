#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "common/statistics.h"
#include "map/frame.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/common/rigid3.h"

namespace mono_pose_tracker {

/// An upright box that hides what is behind it, from low to high in x and z (m).
struct WalkBlock {
  Eigen::Vector2d low, high;
};

/// A walk past walls whose points have their own descriptors: the input of a long walk, without images. The
/// world's axes are those of a level camera that looks along z: x right, y down; metres.
struct FeatureWalk {
  std::vector<Eigen::Vector3d> x_in_world;
  std::vector<Eigen::Vector3d> normal_in_world;  // of the wall that a point is on: seen from there only
  cv::Mat descriptors;                           // N x 128, CV_8U
  std::vector<WalkBlock> blocks;
  std::vector<Rigid3> camera_from_world;  // of each frame
  double length = 0;                      // m, of the way
};

/// Round a block of houses, 200 m, and the first `overlap` metres once more: one loop.
FeatureWalk block_walk(std::uint64_t seed, double overlap = 15);
/// A street, round the block to its left, the street again, round the block to its right, and its beginning
/// once more: two loops, 2 x 110 m.
FeatureWalk figure_eight_walk(std::uint64_t seed);
/// Up a corridor of 60 m, looking at one wall, and back, looking at the other: identical doors every 3 m, and
/// little distinctive texture between them (perceptual aliasing). Only the end is visible twice.
FeatureWalk corridor_walk(std::uint64_t seed);
/// Along a wall, past a room, and 28 m on past another room with the same furniture: nothing is revisited.
FeatureWalk repetitive_corridor_walk(std::uint64_t seed);
/// Round a column in a hall, looking outwards, 1.2 times: a loop of 25 m for quick tests.
FeatureWalk ring_walk(std::uint64_t seed);

/// Straight along a wall, looking at it obliquely, so many frames of 0.5 m: nothing is revisited.
FeatureWalk street_walk(std::uint64_t seed, int frames);
/// To and fro before one wall, so many frames: everything is covisible.
FeatureWalk wall_walk(std::uint64_t seed, int frames);

/// The camera for which the walks are designed: 640 x 480 px, 65 degrees wide, no distortion.
CameraModel walk_camera();

/// Features visible at this position of the walk, each with noise of `noise_px`.
Frame walk_frame(const FeatureWalk& walk, const CameraModel& camera, int index, double noise_px,
                 Random& random);
/// The same, with the point of each feature.
Frame walk_frame(const FeatureWalk& walk, const CameraModel& camera, int index, double noise_px,
                 Random& random, std::vector<int>* point_of);

}  // namespace mono_pose_tracker
