#pragma once

#include <functional>
#include <ostream>
#include <string>

namespace mono_pose_tracker {

/// Calls `write` with a stream on a temporary file beside `path`, then renames it to `path`: a reader sees
/// the old file or the whole new one. Devices, pipes and links are written through instead. Throws
/// std::runtime_error naming the path and the reason when it cannot.
void write_file_atomically(const std::string& path, const std::function<void(std::ostream&)>& write);

/// Makes the folder, and those above it. Throws std::runtime_error naming the path and the reason when it
/// can't be.
void make_folder(const std::string& path);

/// Throws std::runtime_error naming the path when there is something there that is no file, nor a link to
/// one: who opens a pipe waits until somebody reads it.
void require_regular_file(const std::string& path);

}  // namespace mono_pose_tracker
