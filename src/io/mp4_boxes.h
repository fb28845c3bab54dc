#pragma once

#include <string>

namespace mono_pose_tracker {

/// Whether the file is an MP4 or MOV that is whole and has an edit list, which leaves out frames that its
/// index counts: what a trim without encoding anew makes.
bool is_trimmed_mp4(const std::string& path);

/// Whether the file begins as an MP4 or MOV and has no index (box moov), which most programs write at the
/// end: the recording was interrupted, or the file was copied in part.
bool lacks_mp4_index(const std::string& path);

}  // namespace mono_pose_tracker
