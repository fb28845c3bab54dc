#include "simulation/head_scene.h"

#include <algorithm>
#include <cmath>

#include "common/rotation.h"
#include "simulation/ray_march.h"
#include "simulation/texture.h"

namespace mono_pose_tracker {
namespace {

/// Syllables of 0.2 s open the mouth by up to 13 mm each; one in five is a pause.
float mouth_open(std::uint32_t seed, float time) {
  const int syllable = floor_int(time / 0.2f);
  const std::uint32_t h = hash_cell(seed, syllable, 0);
  if (unit_float(h) < 0.2f) return 0;
  const float s = time / 0.2f - static_cast<float>(syllable);
  return (0.004f + 0.009f * unit_float(rehash(h))) * std::pow(std::sin(static_cast<float>(kPi) * s), 2.f);
}

/// The first blink comes within the first second, the next 1 to 2.5 s after it, and so on.
float lids(std::uint32_t seed, float time) {
  constexpr float kBlink = 0.17f;  // s
  float start = 0.3f + 0.5f * unit_float(hash_cell(seed, 0, 0));
  for (int blink = 1; start + kBlink < time; ++blink)
    start += 1.f + 1.5f * unit_float(hash_cell(seed, blink, 0));
  const float s = (time - start) / kBlink;
  return s > 0 ? smooth_step(0.f, 0.35f, s) * smooth_step(1.f, 0.5f, s) : 0.f;
}

/// To a new place, up to 3 mm to the side, every 0.7 s.
float gaze(std::uint32_t seed, float time) {
  return 0.003f * (2.f * unit_float(hash_cell(seed, floor_int(time / 0.7f), 0)) - 1.f);
}

}  // namespace

HeadLook face_look(const FaceMotionOptions& options, std::uint64_t seed, double time) {
  const auto s = static_cast<std::uint32_t>(seed ^ (seed >> 32));
  const auto t = static_cast<float>(time);
  HeadLook look;
  if (options.speaks) look.mouth_open = mouth_open(s, t);
  if (options.blinks) look.lids = lids(s + 1, t);
  if (options.blinks) look.gaze = gaze(s + 2, t);
  look.loose_hair = options.loose_hair;
  look.hair_time = t;
  return look;
}

namespace {

using Eigen::Vector3d;

const Ellipsoid kCranium({0, -0.025, 0.012}, {0.076, 0.092, 0.098});
const Ellipsoid kMidface({0, 0.030, -0.018}, {0.063, 0.085, 0.074});
const Ellipsoid kJaw({0, 0.066, -0.030}, {0.056, 0.050, 0.056});
const Ellipsoid kBrow({0.027, -0.021, -0.080}, {0.026, 0.007, 0.011});
const Ellipsoid kUpperLip({0, 0.0665, -0.083}, {0.024, 0.0065, 0.010});
const Ellipsoid kLowerLip({0, 0.0770, -0.081}, {0.020, 0.0075, 0.010});
const Ellipsoid kEar({0, 0, 0}, {0.009, 0.032, 0.020});

double skull(const Vector3d& p, bool with_neck) {
  double d = ellipsoid(p, kCranium);
  d = blend(d, ellipsoid(p, kMidface), 0.03);
  d = blend(d, ellipsoid(p, kJaw), 0.03);
  if (!with_neck) return d;
  return blend(d, tapered_capsule(p, {0, 0.06, 0.030}, {0, 0.30, 0.050}, 0.052, 0.078), 0.04);
}

double face(const Vector3d& p, double d) {
  d = blend(d, sphere(p, {0, 0.101, -0.070}, 0.018), 0.03);
  d = blend(d, sphere(p, {0.041, 0.028, -0.060}, 0.024), 0.04);
  d = blend(d, ellipsoid(p, kBrow), 0.025);
  d = carve(d, sphere(p, {0.033, 0.002, -0.110}, 0.019), 0.015);
  d = blend(d, sphere(p, {0.032, 0.003, -0.0775}, 0.0140), 0.004);
  d = blend(d, tapered_capsule(p, {0, -0.012, -0.085}, {0, 0.036, -0.110}, 0.007, 0.0105), 0.014);
  d = blend(d, sphere(p, {0.0110, 0.0405, -0.0985}, 0.0075), 0.010);
  d = blend(d, ellipsoid(p, kUpperLip), 0.008);
  d = blend(d, ellipsoid(p, kLowerLip), 0.007);
  return d;
}

double ear(const Vector3d& p) {
  // Flared 25 degrees from the skull.
  constexpr double c = 0.906, s = 0.423;
  const Vector3d q = p - Vector3d(0.080, 0.012, 0.020);
  const Vector3d r(c * q.x() - s * q.z(), q.y(), s * q.x() + c * q.z());
  const double shell = ellipsoid(r, kEar);
  return carve(shell, sphere(r, {0.013, 0.002, -0.002}, 0.0125), 0.005);
}

}  // namespace

double head_distance(const Vector3d& x_in_head, bool with_neck) {
  const double outside = (x_in_head - head_bound_centre()).norm() - kHeadBoundRadius;
  if (outside > 0.05) return outside;
  // Symmetric. Smooth over 3 mm at the middle, where a plain |x| would leave a crease.
  const Vector3d p(std::sqrt(x_in_head.x() * x_in_head.x() + 9e-6), x_in_head.y(), x_in_head.z());
  double d = skull(p, with_neck);
  // Parts far enough not to reach the skull here by their blend (its width: 0.03 m and 0.008 m) count by a
  // ball around them; a blended surface stands out from both parts by a quarter of the width at most.
  const double to_face = sphere(p, {0, 0.035, -0.070}, 0.09);
  d = to_face < 0.03 ? face(p, d) : std::min(d, to_face - 0.008);
  const double to_ear = sphere(p, {0.082, 0.012, 0.020}, 0.036);
  return to_ear < 0.03 ? blend(d, ear(p), 0.008) : std::min(d, to_ear - 0.002);
}

namespace {

using Eigen::Vector3f;

/// One size of spots: balls strewn in space, one to a cell at most, seen where the surface cuts them.
struct Spots {
  float cell;             // m
  float smallest_radius;  // m; the largest is smallest + spread
  float spread;           // m
  float density;          // share of the cells that hold a spot
  float darkest;          // change of brightness at most
};

/// Uniform in [0, 1) from ten bits.
float unit_bits(unsigned bits) { return static_cast<float>(bits & 1023u) * 0x1.0p-10f; }

/// Sum of the darkening by all spots at a point.
float spot_darkness(const Spots& spots, unsigned seed, const Vector3f& x, float footprint) {
  const Vector3f q = x / spots.cell;
  const int x0 = floor_int(q.x() - 0.5f), y0 = floor_int(q.y() - 0.5f), z0 = floor_int(q.z() - 0.5f);
  const float reach = (1.25f * (spots.smallest_radius + spots.spread) + 0.5f * footprint) / spots.cell;
  const float reach_squared = reach * reach;
  float darkness = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = x0 + (corner & 1), j = y0 + (corner >> 1 & 1), k = z0 + (corner >> 2);
    const unsigned h = hash_cell(seed, i, j, k);
    // No nearer than a twentieth of a cell to its sides: spots of up to half a cell stay within the nearest
    // 2^3 cells.
    const Vector3f centre(i + 0.05f + 0.9f * unit_bits(h), j + 0.05f + 0.9f * unit_bits(h >> 10),
                          k + 0.05f + 0.9f * unit_bits(h >> 20));
    const float distance_squared = (q - centre).squaredNorm();
    if (distance_squared > reach_squared) continue;
    const unsigned h1 = rehash(h), h2 = rehash(h1);
    if (unit_float(h1) > spots.density) continue;
    const float radius = spots.smallest_radius + spots.spread * unit_float(h2);
    const float softness = 0.25f * radius + 0.5f * footprint;
    const float distance = spots.cell * std::sqrt(distance_squared);
    const float strength = spots.darkest * (0.4f + 0.6f * unit_float(h2 * 0x9e3779b1u));
    darkness += strength * smooth_step(radius + softness, radius - softness, distance);
  }
  return darkness;
}

float inside(float signed_distance, float softness) {
  return smooth_step(softness, -softness, signed_distance);
}

void paint(float weight, const Vector3f& over, Vector3f* color) { *color += weight * (over - *color); }

/// Skin: redder on cheeks, nose and ears, uneven at all scales, with moles, freckles and pores.
Vector3f skin(unsigned seed, const Vector3f& x, float footprint) {
  Vector3f color(0.80f, 0.63f, 0.53f);
  const float cheek =
      std::exp(-(Vector3f(std::fabs(x.x()) - 0.045f, x.y() - 0.04f, x.z() + 0.07f)).squaredNorm() / 8e-4f);
  const float nose = std::exp(-(x - Vector3f(0, 0.036f, -0.118f)).squaredNorm() / 3e-4f);
  const float ear = smooth_step(0.074f, 0.086f, std::fabs(x.x()));
  paint(0.35f * std::min(1.f, cheek + nose + ear), Vector3f(0.78f, 0.46f, 0.40f), &color);
  color *= 1.f + 0.06f * fractal_noise(seed, x.x(), x.y(), x.z(), 0.03f, 3, footprint);
  color *= 1.f + 0.05f * fractal_noise(seed + 1, x.x(), x.y(), x.z(), 0.006f, 3, footprint);
  const Spots moles{0.024f, 0.0012f, 0.0012f, 0.4f, 0.40f};
  const Spots freckles{0.008f, 0.0009f, 0.0009f, 0.8f, 0.32f};
  const Spots small_freckles{0.0041f, 0.0006f, 0.0007f, 0.9f, 0.32f};
  const float darkness = spot_darkness(moles, seed + 2, x, footprint) +
                         spot_darkness(freckles, seed + 3, x, footprint) +
                         spot_darkness(small_freckles, seed + 4, x, footprint);
  // Melanin takes more of the blue than of the red.
  return color.cwiseProduct(
      Vector3f(1.f - 0.8f * darkness, 1.f - darkness, 1.f - 1.1f * darkness).cwiseMax(0.15f));
}

/// How far (m) loose strands are to the side of where they hang at rest: locks of 2 cm sway each by itself,
/// within a second or so.
float hair_sway(unsigned seed, float time, float around, float along) {
  return 0.0020f * value_noise(seed, 50.f * around, 160.f * along, 1.5f * time);
}

/// Strands that run down from the crown: thin around the head, long along it.
Vector3f hair(unsigned seed, const HeadLook& look, const Vector3f& x, float footprint) {
  constexpr float kRadius = 0.08f;  // m, of the skull: makes lengths of azimuths
  const float z = x.z() - 0.02f;
  float around = kRadius * std::atan2(x.x(), -z);
  const float off_axis = std::max(std::hypot(x.x(), z), 0.01f);
  const float along = 0.25f * x.y() + 0.2f * off_axis;
  const float squeezed = std::max(footprint, footprint * kRadius / off_axis);  // azimuths crowd at the crown
  if (look.loose_hair) around += hair_sway(seed + 15, look.hair_time, around, along);
  const float lock = fractal_noise(seed + 10, around, along, 0.012f, 2, squeezed);
  const float strand = fractal_noise(seed + 11, around, along, 0.003f, 2, squeezed);
  if (!look.loose_hair) return Vector3f(0.30f, 0.22f, 0.16f) * (1.f + 0.30f * lock + 0.80f * strand);
  const float fine = fractal_noise(seed + 14, around, 0.5f * along, 0.0026f, 2, squeezed);
  return Vector3f(0.26f, 0.18f, 0.12f) * std::max(0.2f, 1.f + 0.40f * lock + 0.70f * strand + 0.80f * fine);
}

/// 1 on the scalp, 0 on the face, the neck and the ears.
float hair_weight(unsigned seed, const Vector3f& x) {
  const float hairline = -0.068f + 0.125f * smooth_step(-0.085f, 0.07f, x.z());
  const float ragged = 0.004f * value_noise(seed + 12, 300 * x.x(), 300 * x.y(), 300 * x.z());
  const float scalp = inside(x.y() - hairline + ragged, 0.004f);
  const float ear =
      inside((Eigen::Vector2f((x.y() - 0.012f) / 0.036f, (x.z() - 0.018f) / 0.027f)).norm() - 1.f, 0.08f) *
      smooth_step(0.070f, 0.075f, std::fabs(x.x()));
  return scalp * (1.f - ear);
}

void paint_eyes(const HeadLook& look, const Vector3f& x, float footprint, Vector3f* color) {
  if (x.z() > -0.07f || std::fabs(x.y() - 0.003f) > 0.02f) return;
  const float u = (std::fabs(x.x()) - 0.032f) / 0.0125f, v = x.y() - 0.0035f;
  if (std::fabs(u) > 1.3f) return;
  const float softness = 0.0003f + 0.5f * footprint;
  const float half = 0.0052f * (1.f - u * u);
  const float upper = (1.f - 1.9f * look.lids) * half;  // the upper lid comes down, the lower one stays
  const float lid = std::max(-upper - v, v - half);     // signed distance, about, from the almond's edge
  paint(0.7f * inside(std::fabs(lid) - 0.0007f, softness), Vector3f(0.22f, 0.15f, 0.12f), color);
  const float open = inside(lid + 0.0004f, softness);
  const float r = std::hypot(0.0125f * u - std::copysign(look.gaze, look.gaze * x.x()), v + 0.0005f);
  Vector3f eye(0.82f, 0.80f, 0.77f);
  paint(inside(r - 0.0056f, softness), Vector3f(0.30f, 0.26f, 0.18f), &eye);
  paint(inside(r - 0.0024f, softness), Vector3f(0.05f, 0.05f, 0.05f), &eye);
  paint(open, eye, color);
}

void paint_brows(unsigned seed, const HeadLook& look, const Vector3f& x, float footprint, Vector3f* color) {
  if (x.z() > -0.06f) return;
  const float u = (std::fabs(x.x()) - 0.034f) / 0.021f;
  const float arch = -0.0235f - 0.004f * (1.f - u * u) + 0.002f * u;
  const float ragged = 0.0012f * value_noise(seed + 13, 900 * x.x(), 300 * x.y(), 300 * x.z());
  const float edge = std::max(std::fabs(x.y() - arch) - 0.0042f * std::sqrt(std::max(0.f, 1.f - u * u)),
                              0.021f * (std::fabs(u) - 1.f));
  paint(0.8f * inside(edge + ragged, 0.0012f + 0.5f * footprint), 0.85f * hair(seed + 20, look, x, footprint),
        color);
}

void paint_lips(const Vector3f& x, float footprint, Vector3f* color) {
  if (x.z() > -0.06f) return;
  const float u = x.x() / 0.025f;
  const float half = 0.0100f * std::max(0.f, 1.f - u * u);
  const float softness = 0.0012f + 0.5f * footprint;
  paint(0.6f * inside(std::fabs(x.y() - 0.0715f) - half, softness), Vector3f(0.72f, 0.42f, 0.39f), color);
  paint(
      0.6f * inside(std::fabs(x.y() - 0.0718f) - 0.0008f, 0.0005f + 0.5f * footprint) * (std::fabs(u) < 1.f),
      Vector3f(0.30f, 0.14f, 0.14f), color);
}

/// What a mouth that opens does to the skin about it, where it shows.
struct Mouth {
  Vector3f x_at_rest;                    // the place of the skin that is seen here when the mouth is closed
  float gap = 0;                         // m between the lips, at this x
  float below_edge = 0, above_edge = 0;  // m from the gap's upper and to its lower edge, positive in the gap
};

constexpr float kLipLine = 0.0718f, kMouthHalfWidth = 0.024f;  // y and half its length, m

/// The lower lip takes the chin along, ever less further down and to the sides.
Mouth open_mouth(float open, const Vector3f& x) {
  Mouth mouth{x, 0, 0, 0};
  const float v = x.y() - kLipLine;
  if (open <= 0 || x.z() > -0.03f || v < -0.02f || v > 0.06f) return mouth;
  const float u = x.x() / (kMouthHalfWidth + 0.6f * std::max(v, 0.f));
  mouth.gap = open * std::max(0.f, 1.f - u * u);
  const float up = 0.2f * mouth.gap, down = 0.8f * mouth.gap;
  mouth.below_edge = v + up;
  mouth.above_edge = down - v;
  if (v >= down) {
    mouth.x_at_rest.y() -= down * smooth_step(0.06f, 0.012f, v);
  } else if (v <= -up) {
    mouth.x_at_rest.y() += up * smooth_step(-0.02f, -0.006f, v);
  } else {
    mouth.x_at_rest.y() = kLipLine;
  }
  return mouth;
}

/// The upper teeth, and the dark below them with a tongue in it.
void paint_mouth(const Mouth& mouth, const Vector3f& x, float footprint, Vector3f* color) {
  if (mouth.gap <= 0) return;
  const float softness = 0.0004f + 0.5f * footprint;
  Vector3f within(0.16f, 0.05f, 0.05f);
  paint(0.6f * inside(mouth.above_edge - 0.35f * mouth.gap, 0.002f), Vector3f(0.50f, 0.24f, 0.24f), &within);
  const float between =
      std::fabs(x.x() / 0.0075f - std::floor(x.x() / 0.0075f) - 0.5f);  // 0.5 between two teeth
  const Vector3f tooth = Vector3f(0.80f, 0.78f, 0.71f) * (1.f - 0.35f * smooth_step(0.42f, 0.5f, between));
  paint(inside(mouth.below_edge - 0.0045f, softness), tooth, &within);
  paint(inside(-std::min(mouth.below_edge, mouth.above_edge), softness), within, color);
}

/// Brows do not sway.
HeadLook at_rest(HeadLook look) {
  look.loose_hair = false;
  return look;
}

}  // namespace

Vector3f head_albedo(unsigned seed, const HeadLook& look, const Vector3f& x, float footprint) {
  const float scalp = hair_weight(seed, x);
  Vector3f color = hair(seed, look, x, footprint);
  if (scalp < 1.f) {
    const Mouth mouth = open_mouth(look.mouth_open, x);
    Vector3f face = skin(seed, mouth.x_at_rest, footprint);
    paint_lips(mouth.x_at_rest, footprint, &face);
    paint_brows(seed, at_rest(look), x, footprint, &face);
    paint_eyes(look, x, footprint, &face);
    paint_mouth(mouth, x, footprint, &face);
    color = face + scalp * (color - face);
  }
  return color;
}

namespace {

/// Blinn's and Phong's highlight of a light, bright where the normal halves the angle between it and the
/// camera.
float highlight(const Vector3f& normal, const Vector3f& to_camera, const Vector3f& to_light,
                float sharpness) {
  return std::pow(std::max(0.f, normal.dot((to_light + to_camera).normalized())), sharpness);
}

}  // namespace

Color skin_light(const Vector3f& normal, double free, const Lighting& lighting) {
  // Light goes a little way through skin: the edge of the shadow lies beyond the horizon.
  const float key = std::max(0.f, (normal.dot(lighting.key_direction_in_map) + 0.3f) / 1.3f);
  const float fill = 0.5f + 0.5f * normal.dot(lighting.fill_direction_in_map);
  const float open = 0.35f + 0.65f * static_cast<float>(std::clamp(free, 0.0, 1.0));
  return Color(1.0f, 0.98f, 0.95f) * (0.92f * key * (0.4f + 0.6f * open)) +
         Color(0.95f, 0.98f, 1.0f) * (0.48f * fill * open);
}

Vector3f uneven_normal(std::uint32_t seed, const Eigen::Vector3d& x, const Eigen::Vector3d& normal) {
  const Vector3f p = x.cast<float>();
  const auto tilt = [&](std::uint32_t axis) {
    return fractal_noise(seed + axis, p.x(), p.y(), p.z(), 0.008f, 3, 1e-4f);
  };
  return (normal.cast<float>() + 0.10f * Vector3f(tilt(0), tilt(1), tilt(2))).normalized();
}

Color reflected_light(const Vector3f& normal, const Eigen::Vector3d& to_camera, const Lighting& lighting) {
  const Vector3f view = to_camera.cast<float>();
  return Color(1.0f, 0.97f, 0.92f) * highlight(normal, view, lighting.key_direction_in_map, 60) +
         Color(0.90f, 0.95f, 1.0f) * (0.5f * highlight(normal, view, lighting.fill_direction_in_map, 25));
}

namespace {

const Ball kHeadBall{head_bound_centre(), kHeadBoundRadius};

}  // namespace

bool HeadScene::intersect(const Ray& ray, double start, Hit* hit) const {
  const auto field = [this](const Vector3d& x) { return head_distance(x, look_.neck); };
  if (!intersect_field(field, kHeadBall, ray, start, hit)) return false;
  hit->surface = 0;
  return true;
}

double HeadScene::free_distance(const Ray& axis, double slope) const {
  return march_cone([this](const Vector3d& x) { return head_distance(x, look_.neck); }, kHeadBall, axis,
                    slope);
}

Color HeadScene::albedo(const Hit&, const Vector3d& x_in_map, float footprint) const {
  return head_albedo(seed_, look_, x_in_map.cast<float>(), footprint);
}

Color HeadScene::irradiance(const Hit& hit, const Vector3d& x_in_map, const Lighting& lighting) const {
  // Hollows see less of the surroundings: the free distance a finger's breadth off the surface tells how
  // much.
  constexpr double kBreadth = 0.015;
  const double free = head_distance(x_in_map + kBreadth * hit.normal_in_map, look_.neck) / kBreadth;
  return skin_light(hit.normal_in_map.cast<float>(), free, lighting);
}

Color HeadScene::gloss(const Hit& hit, const Vector3d& x_in_map, const Vector3d& to_camera,
                       const Lighting& lighting) const {
  if (look_.shine <= 0) return Color::Zero();
  return look_.shine *
         reflected_light(uneven_normal(seed_ + 30, x_in_map, hit.normal_in_map), to_camera, lighting);
}

}  // namespace mono_pose_tracker
