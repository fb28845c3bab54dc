#pragma once

#include <string>
#include <string_view>

#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/map/map.h"

namespace mono_pose_tracker {

/// What a map was made with. It can be gone on with only by the same.
struct MapOrigin {
  CameraParameters camera;
  std::string descriptor;  // kind of the features' descriptors: "root_sift", ...
};

/// Map files, version 1. All numbers little-endian, reals IEEE 754. Transforms: quaternion x y z w,
/// translation x y z (f64).
///
///     "MPTMAP\r\n"   8 bytes
///     u32 version    1
///     u32 sections   4
///     4 sections in this order, each:
///       name         4 letters
///       u64 size     of the payload in bytes
///       u32 crc      CRC-32 (that of zlib) of name, size and payload
///       payload
///     ORIG  u32 width height; f64 fx fy cx cy; text distortion_model; u32 n, n f64 distortion;
///           text descriptor; u32 scale_source (text: u32 length, letters)
///     KEYF  u32 n, n keyframes: i32 id; i64 frame_index; i64 stamp_ns; camera_from_map; u32 m, m features:
///           f32 x y scale angle response (px, px, px, rad, contrast); u8 r g b; 128 u8 descriptor
///     REMV  u32 n, n removed keyframes: i32 id; i64 frame_index; i32 parent; removed_from_parent
///     LAND  u32 n, n landmarks: i32 id; f64 x y z; i32 created_by; u32 m, m observations: i32 keyframe
///     feature
///
/// Ids are those of the map; they mean nothing outside the file.

/// Written to a file beside it which is then renamed: a reader sees the old file or the whole new one. Throws
/// std::runtime_error naming the path when it cannot be written.
void write_map_file(const std::string& path, const MapOrigin& origin, const Map& map);

/// Throws std::runtime_error, one line that names the file, what is wrong with it and what was expected: it
/// is no map, of another version, damaged, cut short, of another camera, or contradicts itself. Whatever the
/// file holds, no more memory is asked for than a small multiple of its size.
Map read_map_file(const std::string& path, const MapOrigin& expected);

/// The same of a file's content; the message does not name the file.
Map parse_map(std::string_view bytes, const MapOrigin& expected);

}  // namespace mono_pose_tracker
