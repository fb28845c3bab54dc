#include "scene_page.h"

#include <algorithm>
#include <string_view>

#include "../json.h"
#include "io/files.h"
#include "scene_page_text.h"

namespace mono_pose_tracker {

namespace {

std::string base64(const std::uint8_t* bytes, std::size_t size) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((size + 2) / 3 * 4);
  for (std::size_t i = 0; i < size; i += 3) {
    const std::size_t count = std::min<std::size_t>(3, size - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) {
      text.push_back(k <= count ? kDigits[group >> (18 - 6 * k) & 63] : '=');
    }
  }
  return text;
}

// Browsers are little-endian, as WebGL's arrays are the machine's.
void append_little_endian(float value, std::vector<std::uint8_t>* bytes) {
  std::uint32_t bits = 0;
  static_assert(sizeof bits == sizeof value);
  std::copy_n(reinterpret_cast<const char*>(&value), sizeof bits, reinterpret_cast<char*>(&bits));
  for (int shift = 0; shift < 32; shift += 8) bytes->push_back(static_cast<std::uint8_t>(bits >> shift));
}

Json json_of(const Eigen::Vector3d& x) { return {x.x(), x.y(), x.z()}; }

/// All positions are drawn relative to it: 32 bits hold them then.
Eigen::Vector3d origin_of(const ScenePage& page) {
  for (const SceneImage& image : page.images) {
    if (image.map_from_camera) return image.map_from_camera->translation;
  }
  return Eigen::Vector3d::Zero();
}

void add_points(const ScenePage& page, const ScenePageOptions& options, const Eigen::Vector3d& origin,
                Json* json) {
  const std::size_t step = (page.points.size() + options.max_points - 1) / options.max_points;
  std::vector<std::uint8_t> xyz, rgb;
  for (std::size_t i = 0; i < page.points.size(); i += std::max<std::size_t>(1, step)) {
    const ColoredPoint& point = page.points[i];
    if (!point.x_in_map.allFinite()) continue;
    for (int axis = 0; axis < 3; ++axis) {
      append_little_endian(static_cast<float>(point.x_in_map[axis] - origin[axis]), &xyz);
    }
    rgb.insert(rgb.end(), {point.r, point.g, point.b});
  }
  (*json)["xyz"] = base64(xyz.data(), xyz.size());
  (*json)["rgb"] = base64(rgb.data(), rgb.size());
}

/// Every so many images keep their thumbnails.
std::size_t thumbnail_step(const ScenePage& page, const ScenePageOptions& options) {
  std::size_t bytes = 0;
  for (const SceneImage& image : page.images) bytes += image.thumbnail.size();
  return 1 + bytes / std::max<std::size_t>(1, options.max_thumbnail_bytes);
}

Json json_of(const SceneImage& image, bool with_thumbnail) {
  Json json = {{"n", image.name}};
  if (image.time) json["t"] = *image.time;
  if (image.map_from_camera) {
    const Eigen::Vector3d& x = image.map_from_camera->translation;
    const Eigen::Quaterniond& q = image.map_from_camera->rotation;
    json["p"] = {x.x(), x.y(), x.z(), q.x(), q.y(), q.z(), q.w()};
  }
  if (image.state != SceneImage::State::kRegistered) json["s"] = static_cast<int>(image.state);
  if (image.is_keyframe) json["k"] = 1;
  if (image.inliers >= 0) json["i"] = image.inliers;
  if (image.error) json["e"] = *image.error;
  if (!image.notes.empty()) json["f"] = image.notes;
  if (with_thumbnail && !image.thumbnail.empty()) {
    json["j"] = base64(image.thumbnail.data(), image.thumbnail.size());
  }
  return json;
}

Json to_json(const ScenePage& page, const ScenePageOptions& options) {
  const Eigen::Vector3d origin = origin_of(page);
  Json json = {{"title", page.title},
               {"unit", page.unit},
               {"up", json_of(page.up)},
               {"origin", json_of(origin)},
               {"frustum", {page.tan_half_width, page.tan_half_height}},
               {"findings", page.findings},
               {"worst", page.worst_error}};
  add_points(page, options, origin, &json);
  const std::size_t step = thumbnail_step(page, options);
  Json images = Json::array(), loops = Json::array(), reference = Json::array();
  for (std::size_t i = 0; i < page.images.size(); ++i) {
    images.push_back(json_of(page.images[i], i % step == 0));
  }
  for (const auto& [from, to] : page.loops) loops.push_back({from, to});
  for (const Eigen::Vector3d& x : page.reference) reference.push_back(json_of(x));
  json["images"] = std::move(images);
  json["loops"] = std::move(loops);
  json["reference"] = std::move(reference);
  return json;
}

/// Within a script element only "<" can end it.
std::string script_text(const Json& json) {
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string escaped;
  escaped.reserve(text.size());
  for (char c : text) {
    if (c == '<') {
      escaped += "\\u003c";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

}  // namespace

void write_scene_page(const std::string& path, const ScenePage& page, const ScenePageOptions& options) {
  constexpr std::string_view kPlace = "@SCENE@";
  const std::string_view text(kScenePageText);
  const std::size_t at = text.find(kPlace);
  const std::string scene = script_text(to_json(page, options));
  write_file_atomically(path, [&](std::ostream& out) {
    out << text.substr(0, at) << scene << text.substr(at + kPlace.size());
  });
}

}  // namespace mono_pose_tracker
