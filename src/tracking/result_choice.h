#pragma once

#include "mono_pose_tracker/tracking/recording.h"

namespace mono_pose_tracker {

// What one attempt at a recording came to, and which of two is kept (track_until_sure).

// Its map is sure, hangs together and does not rest on two views: confirmed, but for what no further attempt
// changes (of which body it is, how well its path is known).
bool is_founded(const RecordingResult& result);

// An object that is lost while it turns leaves several maps, and is often found again from another beginning;
// its recordings are short.
bool fell_apart(const RecordingResult& result);

// Of up to 150 images all attempts take a minute or so.
bool is_short(const RecordingResult& result);

bool lacks_images(const RecordingResult& result);

// Poses three quarters as many images as the other at least: a sure piece of the recording is no better
// answer than most of it with a warning.
bool is_most_of(const RecordingResult& result, const RecordingResult& before);

// Needs no further attempt. The more attempts at little that was told from a background, the sooner one
// agrees with itself on the wrong thing: it is not tried again for being loose.
bool is_enough(const RecordingResult& result, bool is_masked);

// Whether it takes the place of `before`: it must be better founded, or as well and hold more; a few images
// more are no gain where plainly less of what moves in all of them is explained. By masks of what moves, most
// of the images are better than all by what was not told from the background.
bool is_better(const RecordingResult& result, bool is_masked, const RecordingResult& before);

}  // namespace mono_pose_tracker
