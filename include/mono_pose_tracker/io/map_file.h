#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// A run that used the maps: images of one camera, with the frame indices first_frame, first_frame + 1, ...
struct MapSession {
  CameraParameters camera;
  std::int64_t first_frame = 0;
  std::int64_t frames = 0;

  bool holds(std::int64_t frame_index) const {
    return frame_index >= first_frame && frame_index - first_frame < frames;
  }
};

/// Everything stored of one or more runs: maps that could not be joined have frames and units of their own.
struct SavedMaps {
  std::string descriptor;            // kind of the features' descriptors: "root_sift", ...
  std::vector<MapSession> sessions;  // by first_frame; no two hold the same frame
  std::vector<Map> maps;             // oldest first; of each keyframe, a session holds the frame

  /// Shifts all frame indices so that the last session ends before frame 0; a further run counts from 0.
  void end_before_zero();
};

/// Map files, version 2. All numbers little-endian, reals IEEE 754. Transforms: quaternion x y z w,
/// translation x y z (f64).
///
///     "MPTMAP\r\n"   8 bytes
///     u32 version    2
///     u32 sections   1 + 3 * number of maps
///     the sections, each:
///       name         4 letters
///       u64 size     of the payload in bytes
///       u32 crc      CRC-32 (that of zlib) of name, size and payload
///       payload
///     HEAD  text descriptor; u32 n, n cameras: u32 width height; f64 fx fy cx cy; text distortion_model;
///           u32 m, m f64 distortion; u32 n, n sessions: u32 camera (counted from 0); i64 first_frame frames;
///           u32 n, n maps: u32 scale_source (text: u32 length, letters)
///   then for each map
///     KEYF  u32 n, n keyframes: i32 id; i64 frame_index; i64 stamp_ns; camera_from_map; u32 m, m features:
///           f32 x y scale angle response (px, px, px, rad, contrast); u8 r g b; 128 u8 descriptor
///     REMV  u32 n, n removed keyframes: i32 id; i64 frame_index; i32 parent; removed_from_parent
///     LAND  u32 n, n landmarks: i32 id; f64 x y z; i32 created_by; u32 m, m observations: i32 keyframe
///           feature
///
/// Ids are those of the map; they mean nothing outside the file. A keyframe is of the session that holds its
/// frame_index. What is made of the features (bearings, the place index) is not in the file.
///
/// Version 1 is read as well: one map of one camera, ORIG (the camera; text descriptor; u32 scale_source) in
/// place of HEAD, and one session, from the first to the last frame that it names.

/// Written to a file beside it which is then renamed: a reader sees the old file or the whole new one. Throws
/// std::runtime_error naming the path when it cannot be written, std::invalid_argument on a keyframe of no
/// session and when there is no map.
void write_map_file(const std::string& path, const SavedMaps& saved);

/// descriptor: the kind of descriptors that the reader can use; any cameras are accepted. Throws
/// std::runtime_error, one line that names the file, its defect and what was expected: no map, another
/// version, damaged, truncated, of another kind, or inconsistent. Memory use is limited to a small multiple
/// of the file's size.
SavedMaps read_map_file(const std::string& path, const std::string& descriptor);

/// Reads the content of a file; the message does not name the file.
SavedMaps parse_maps(std::string_view bytes, const std::string& descriptor);

}  // namespace mono_pose_tracker
