#include <future>
#include <memory>
#include <stdexcept>
#include <utility>

#include "mono_pose_tracker/io/map_file.h"
#include "ros/guard.h"
#include "ros/paths.h"
#include "ros/tracker_nodelet.h"

namespace mono_pose_tracker {
namespace {

// Time for which a service waits for its turn between two images; an image takes some tens of milliseconds.
constexpr std::chrono::seconds kServiceTimeout{10};

std::string size_text(const std::vector<Map>& maps) {
  std::size_t keyframes = 0, landmarks = 0;
  for (const Map& map : maps) keyframes += map.keyframes().size(), landmarks += map.landmarks().size();
  return std::to_string(keyframes) + " keyframes and " + std::to_string(landmarks) + " landmarks" +
         (maps.size() > 1 ? " of " + std::to_string(maps.size()) + " maps" : "");
}

}  // namespace

template <typename Result>
Result TrackerNodelet::on_processing_thread(std::function<Result()> command) {
  auto task = std::make_shared<std::packaged_task<Result()>>(std::move(command));
  std::future<Result> result = task->get_future();
  const char* const shuts_down = "the tracker is shutting down";
  if (!slot_->post([task] { (*task)(); })) throw std::runtime_error(shuts_down);
  task.reset();
  if (result.wait_for(kServiceTimeout) != std::future_status::ready) {
    throw std::runtime_error("the tracker is busy and did not process the call in time: call again");
  }
  try {
    return result.get();
  } catch (const std::future_error&) {  // the slot was closed and its commands dropped
    throw std::runtime_error(shuts_down);
  }
}

std::string TrackerNodelet::path_parameter(const std::string& name, const std::string& at_start) {
  std::string path = at_start;
  const ros::NodeHandle& handle = getPrivateNodeHandle();
  if (handle.hasParam(name) && !handle.getParam(name, path)) {
    throw std::runtime_error("~" + name + " is not a text: expected a path");
  }
  if (path.empty()) throw std::runtime_error("~" + name + " is empty: expected a path");
  return expand_path(path);
}

std::string TrackerNodelet::path_to_replace(const std::string& name, const std::string& at_start) {
  std::string path = path_parameter(name, at_start);
  const std::string problem = one_file_problem(name, path, "trajectory_file", parameters_.trajectory_file);
  if (!problem.empty()) throw std::runtime_error(problem);
  return path;
}

// By a command, on the processing thread: what is known is of a map that is no more.
void TrackerNodelet::drop_map() {
  placement_->forget();
  publishers_->drop_map();
  board_->note(tracker_->state(), tracker_->epoch());
}

void TrackerNodelet::advertise_services() {
  advertise("reset", [this] {
    on_processing_thread<void>([this] {
      tracker_->reset();
      drop_map();
    });
    NODELET_WARN("reset by ~reset: the map is dropped, tracking restarts");
    return std::string("the map is dropped");
  });
  advertise("pause", [this] {
    paused_ = true;
    slot_->post([this] { placement_->forget(); });
    return std::string("paused: images are not tracked; call ~resume to continue");
  });
  advertise("resume", [this] {
    slot_->post([this] { placement_->forget(); });  // what an image gave that was at work as ~pause came
    paused_ = false;
    return std::string("tracking continues");
  });
  advertise("save_trajectory", [this] {
    const std::string path = path_to_replace("save_trajectory_path", parameters_.save_trajectory_path);
    const std::vector<KeyframePose> poses = publishers_->trajectory();
    write_tum_trajectory(path, poses);
    return std::to_string(poses.size()) + " poses in " + path;
  });
  advertise_map_services();
}

void TrackerNodelet::advertise_map_services() {
  // Files are written and read on the service's thread: images go on meanwhile.
  advertise("save_map", [this] {
    const std::string path = path_to_replace("map_path", parameters_.map_path);
    const auto saved = on_processing_thread<SavedMaps>([this] { return tracker_->copy_maps(); });
    write_map_file(path, saved);
    return size_text(saved.maps) + " in " + path;
  });
  advertise("load_map", [this] {
    const std::string path = path_parameter("map_path", parameters_.map_path);
    const auto saved = std::make_shared<SavedMaps>(read_map_file(path, descriptor_kind(parameters_.tracker)));
    const std::string size = size_text(saved->maps);
    const bool loaded = on_processing_thread<bool>([this, saved] {
      const bool is_loaded = tracker_->load_maps(std::move(*saved));
      if (is_loaded) {
        drop_map();
      } else {
        board_->note(tracker_->state(), tracker_->epoch());
      }
      return is_loaded;
    });
    const std::string what = size + " from " + path;
    const std::string then =
        loaded ? "the camera is lost until an image is relocalised in it" : "loaded when camera_info arrives";
    NODELET_WARN("%s: %s", what.c_str(), then.c_str());
    return what + "; " + then;
  });
}

void TrackerNodelet::load_map_at_start() {
  const std::string path = path_parameter("map_path", parameters_.map_path);
  SavedMaps saved = read_map_file(path, descriptor_kind(parameters_.tracker));
  NODELET_INFO("%s from %s: loaded when camera_info arrives", size_text(saved.maps).c_str(), path.c_str());
  tracker_->load_maps(std::move(saved));
}

// Not on the nodelet's queue, because a service waiting for the tracker would delay images. Not on the
// manager's thread pool either: a callback there keeps a nodelet alive while it is unloaded, but not its
// other queue.
ros::NodeHandle TrackerNodelet::service_handle() {
  ros::NodeHandle handle(getPrivateNodeHandle());
  handle.setCallbackQueue(&service_queue_);
  return handle;
}

void TrackerNodelet::advertise(const std::string& name, Answer answer) {
  using Request = std_srvs::Trigger::Request;
  using Response = std_srvs::Trigger::Response;
  services_.push_back(service_handle().advertiseService<Request, Response>(
      name,
      boost::function<bool(Request&, Response&)>([answer = std::move(answer)](Request&, Response& response) {
        response.success = false;
        guarded(
            [&] {
              response.message = answer();
              response.success = true;
            },
            [&](const std::string& text) { response.message = text; });
        return true;
      })));
}

}  // namespace mono_pose_tracker
