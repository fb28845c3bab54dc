#include "mono_pose_tracker/io/map_file.h"

#include <boost/crc.hpp>
#include <cmath>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "byte_stream.h"
#include "mono_pose_tracker/io/atomic_file.h"
#include "mono_pose_tracker/io/text_file.h"

namespace mono_pose_tracker {

namespace {

constexpr std::string_view kMagic("MPTMAP\r\n",
                                  8);  // the line end shows whether a transfer as text mangled it
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kSections = 4;
constexpr int kDescriptorBytes = 128;
// The least bytes of a record: what a count is held against before memory is asked for.
constexpr std::size_t kTransformBytes = 7 * 8, kFeatureBytes = 5 * 4 + 3 + kDescriptorBytes;
constexpr std::size_t kKeyframeBytes = 4 + 8 + 8 + kTransformBytes + 4;
constexpr std::size_t kRemovedBytes = 4 + 8 + 4 + kTransformBytes;
constexpr std::size_t kObservationBytes = 4 + 4, kLandmarkBytes = 4 + 3 * 8 + 4 + 4;

std::uint32_t crc_of(std::string_view name_and_size, std::string_view payload) {
  boost::crc_32_type crc;
  crc.process_bytes(name_and_size.data(), name_and_size.size());
  crc.process_bytes(payload.data(), payload.size());
  return crc.checksum();
}

void write_transform(const Rigid3& b_from_a, ByteWriter* out) {
  for (int i = 0; i < 4; ++i) out->f64(b_from_a.rotation.coeffs()[i]);
  for (int i = 0; i < 3; ++i) out->f64(b_from_a.translation[i]);
}

void write_origin(const MapOrigin& origin, ScaleSource scale_source, ByteWriter* out) {
  const CameraParameters& camera = origin.camera;
  out->u32(static_cast<std::uint32_t>(camera.width));
  out->u32(static_cast<std::uint32_t>(camera.height));
  for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy}) out->f64(value);
  out->text(camera.distortion_model);
  out->u32(static_cast<std::uint32_t>(camera.distortion.size()));
  for (const double value : camera.distortion) out->f64(value);
  out->text(origin.descriptor);
  out->u32(static_cast<std::uint32_t>(scale_source));
}

void write_keyframe(const Keyframe& keyframe, ByteWriter* out) {
  out->i32(keyframe.id);
  out->i64(keyframe.frame_index);
  out->i64(keyframe.stamp_ns);
  write_transform(keyframe.camera_from_map, out);
  const ImageFeatures& image = *keyframe.image;
  out->u32(static_cast<std::uint32_t>(image.size()));
  for (int i = 0; i < image.size(); ++i) {
    const Feature& f = image.set.features[i];
    for (const float value : {f.pixel.x(), f.pixel.y(), f.scale, f.angle, f.response}) out->f32(value);
    for (int c = 0; c < 3; ++c) out->u8(image.color_rgb[i][c]);
    out->raw(image.set.descriptor(i), kDescriptorBytes);
  }
}

void write_landmark(const Landmark& landmark, ByteWriter* out) {
  out->i32(landmark.id);
  for (int i = 0; i < 3; ++i) out->f64(landmark.x_in_map[i]);
  out->i32(landmark.created_by);
  out->u32(static_cast<std::uint32_t>(landmark.observations.size()));
  for (const Observation& o : landmark.observations) {
    out->i32(o.keyframe);
    out->i32(o.feature);
  }
}

void write_section(const char* name, const ByteWriter& payload, std::ostream& stream) {
  ByteWriter head;
  head.raw(name, 4);
  head.u64(payload.bytes().size());
  ByteWriter crc;
  crc.u32(crc_of(head.bytes(), payload.bytes()));
  stream << head.bytes() << crc.bytes() << payload.bytes();
}

// What is read from here on has the checksum it was written with: these errors are of a file that was made
// wrong.
[[noreturn]] void contradiction(const std::string& what) {
  throw std::runtime_error("contradicts itself (" + what + ")");
}

double finite(double value) {
  if (!std::isfinite(value)) contradiction("a number is not finite");
  return value;
}

// Far from the ends of its type, where indices may be counted on and shifted.
std::int64_t frame_index(ByteReader& in) {
  constexpr std::int64_t kMost = std::int64_t{1} << 53;
  const std::int64_t value = in.i64();
  if (value < -kMost || value > kMost) contradiction("a frame's number is none");
  return value;
}

int id(ByteReader& in) {
  const int value = in.i32();
  if (value < 0 || value == std::numeric_limits<int>::max()) contradiction("an id is negative");
  return value;
}

Rigid3 read_transform(ByteReader& in) {
  Rigid3 b_from_a;
  for (int i = 0; i < 4; ++i) b_from_a.rotation.coeffs()[i] = finite(in.f64());
  for (int i = 0; i < 3; ++i) b_from_a.translation[i] = finite(in.f64());
  if (std::abs(b_from_a.rotation.norm() - 1) > 1e-6) contradiction("a rotation is none");
  return b_from_a;
}

struct Head {
  MapOrigin origin;
  ScaleSource scale_source = ScaleSource::kMapUnits;
};

Head read_head(ByteReader& in) {
  Head head;
  CameraParameters& camera = head.origin.camera;
  camera.width = static_cast<int>(in.u32());
  camera.height = static_cast<int>(in.u32());
  for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *value = in.f64();
  camera.distortion_model = in.text();
  camera.distortion.resize(in.count(8));
  for (double& value : camera.distortion) value = in.f64();
  head.origin.descriptor = in.text();
  const std::uint32_t source = in.u32();
  if (source > static_cast<std::uint32_t>(ScaleSource::kOdometry)) contradiction("a scale of no known kind");
  head.scale_source = static_cast<ScaleSource>(source);
  return head;
}

Keyframe read_keyframe(ByteReader& in, const CameraModel& camera) {
  Keyframe keyframe;
  keyframe.id = id(in);
  keyframe.frame_index = frame_index(in);
  keyframe.stamp_ns = in.i64();
  keyframe.camera_from_map = read_transform(in);
  const std::uint32_t n = in.count(kFeatureBytes);
  FeatureSet set;
  set.features.resize(n);
  set.descriptors = cv::Mat(static_cast<int>(n), kDescriptorBytes, CV_8U);
  std::vector<cv::Vec3b> colors(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    Feature& f = set.features[i];
    for (float* value : {&f.pixel.x(), &f.pixel.y(), &f.scale, &f.angle, &f.response}) {
      *value = static_cast<float>(finite(in.f32()));
    }
    if (f.scale <= 0) contradiction("a feature has no scale");
    for (int c = 0; c < 3; ++c) colors[i][c] = in.u8();
    std::memcpy(set.descriptors.ptr(static_cast<int>(i)), in.raw(kDescriptorBytes).data(), kDescriptorBytes);
  }
  try {
    keyframe.image = restore_image_features(std::move(set), std::move(colors), camera);
  } catch (const std::invalid_argument& e) {
    contradiction(e.what());
  }
  return keyframe;
}

std::vector<Keyframe> read_keyframes(ByteReader& in, const CameraModel& camera) {
  const std::uint32_t n = in.count(kKeyframeBytes);
  if (n == 0) contradiction("no keyframe");
  std::vector<Keyframe> keyframes;
  keyframes.reserve(n);
  for (std::uint32_t i = 0; i < n; ++i) keyframes.push_back(read_keyframe(in, camera));
  return keyframes;
}

std::map<KeyframeId, KeyframeLink> read_removed(ByteReader& in) {
  std::map<KeyframeId, KeyframeLink> removed;
  for (std::uint32_t n = in.count(kRemovedBytes); n > 0; --n) {
    KeyframeLink& link = removed[id(in)];
    link.frame_index = frame_index(in);
    link.parent = id(in);
    link.removed_from_parent = read_transform(in);
  }
  return removed;
}

std::vector<Landmark> read_landmarks(ByteReader& in) {
  std::vector<Landmark> landmarks(in.count(kLandmarkBytes));
  for (Landmark& landmark : landmarks) {
    landmark.id = id(in);
    for (int i = 0; i < 3; ++i) landmark.x_in_map[i] = finite(in.f64());
    landmark.created_by = in.i32();
    landmark.observations.resize(in.count(kObservationBytes));
    if (landmark.observations.size() < 2) contradiction("a landmark that fewer than two keyframes see");
    for (Observation& o : landmark.observations) {
      o.keyframe = id(in);
      o.feature = id(in);
    }
  }
  return landmarks;
}

std::string describe(const CameraParameters& camera) {
  char text[160];
  std::snprintf(text, sizeof text, "%dx%d, fx %.6g, fy %.6g, cx %.6g, cy %.6g, %s", camera.width,
                camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
                camera.distortion_model.empty() ? "no distortion" : camera.distortion_model.c_str());
  return text;
}

void check_origin(const MapOrigin& found, const MapOrigin& expected) {
  if (found.camera != expected.camera) {
    const std::string is = describe(found.camera), here = describe(expected.camera);
    throw std::runtime_error("was made with another camera (" + is + "), expected " +
                             (is == here ? "other distortion coefficients" : here));
  }
  if (found.descriptor != expected.descriptor) {
    throw std::runtime_error("has descriptors of another kind (" + found.descriptor + "), expected " +
                             expected.descriptor);
  }
}

ByteReader open_section(const char* name, ByteReader& in) {
  const std::string_view head = in.raw(12);
  const std::uint32_t crc = in.u32();
  const std::string_view payload = in.raw(ByteReader(head.substr(4)).u64());
  if (crc_of(head, payload) != crc || head.substr(0, 4) != name) {
    throw std::runtime_error(std::string("is damaged (the checksum of section ") + name + " does not hold)");
  }
  return ByteReader(payload);
}

void close_section(const ByteReader& section) {
  if (section.left() > 0) contradiction("a section is longer than what it holds");
}

}  // namespace

void write_map_file(const std::string& path, const MapOrigin& origin, const Map& map) {
  require_regular_file(path);
  ByteWriter head, keyframes, removed, landmarks;
  write_origin(origin, map.scale_source(), &head);
  keyframes.u32(static_cast<std::uint32_t>(map.keyframes().size()));
  for (const auto& entry : map.keyframes()) write_keyframe(entry.second, &keyframes);
  removed.u32(static_cast<std::uint32_t>(map.removed_keyframes().size()));
  for (const auto& [id, link] : map.removed_keyframes()) {
    removed.i32(id);
    removed.i64(link.frame_index);
    removed.i32(link.parent);
    write_transform(link.removed_from_parent, &removed);
  }
  landmarks.u32(static_cast<std::uint32_t>(map.landmarks().size()));
  for (const LandmarkId id : map.landmark_ids()) write_landmark(*map.landmark(id), &landmarks);
  write_file_atomically(path, [&](std::ostream& stream) {
    ByteWriter start;
    start.raw(kMagic.data(), kMagic.size());
    start.u32(kVersion);
    start.u32(kSections);
    stream << start.bytes();
    write_section("ORIG", head, stream);
    write_section("KEYF", keyframes, stream);
    write_section("REMV", removed, stream);
    write_section("LAND", landmarks, stream);
  });
}

Map parse_map(std::string_view bytes, const MapOrigin& expected) {
  if (bytes.substr(0, kMagic.size()) != kMagic) throw std::runtime_error("is no map file");
  ByteReader in(bytes.substr(kMagic.size()));
  const std::uint32_t version = in.u32();
  if (version != kVersion) {
    throw std::runtime_error("is of version " + std::to_string(version) + ", expected " +
                             std::to_string(kVersion));
  }
  if (in.u32() != kSections) throw std::runtime_error("is damaged (its number of sections)");
  ByteReader section = open_section("ORIG", in);
  const Head head = read_head(section);
  close_section(section);
  check_origin(head.origin, expected);
  section = open_section("KEYF", in);
  std::vector<Keyframe> keyframes = read_keyframes(section, CameraModel(expected.camera));
  close_section(section);
  section = open_section("REMV", in);
  std::map<KeyframeId, KeyframeLink> removed = read_removed(section);
  close_section(section);
  section = open_section("LAND", in);
  std::vector<Landmark> landmarks = read_landmarks(section);
  close_section(section);
  if (in.left() > 0) throw std::runtime_error("is damaged (something follows its end)");
  try {
    return Map::restore(std::move(keyframes), std::move(landmarks), std::move(removed), head.scale_source);
  } catch (const std::invalid_argument& e) {
    contradiction(e.what());
  }
}

Map read_map_file(const std::string& path, const MapOrigin& expected) {
  // A device could be read for ever.
  if (std::filesystem::exists(path) && !std::filesystem::is_regular_file(path)) {
    throw std::runtime_error(path + ": is no regular file, expected a map file");
  }
  const std::string bytes = read_text_file(path, "a map file", std::numeric_limits<std::size_t>::max());
  try {
    return parse_map(bytes, expected);
  } catch (const std::exception& e) {
    throw std::runtime_error(path + ": " + e.what());
  }
}

}  // namespace mono_pose_tracker
