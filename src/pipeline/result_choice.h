#pragma once

#include "pipeline/recording.h"

namespace mono_pose_tracker {

struct ResultChoiceOptions {
  double matches_per_edge = 100;  // for full weight: four times the minimum. A map of few landmarks may
                                  // explain all of its matches
  double margin = 1.01;           // minimum ratio of scores for the later result
  double min_share = 0.75;        // of the images of another result, for about as many
};

// The number of images registered in the first map, times the share of the view graph's verified matches that
// it explains: the only score by which results are compared.
double score(const RecordingResult& result, const ResultChoiceOptions& options = {});

// Whether the result replaces the previous one. A confirmed result replaces an unconfirmed one that does not
// have far more images; otherwise the score must be higher by a margin.
bool is_better(const RecordingResult& result, const RecordingResult& before,
               const ResultChoiceOptions& options = {});

// Nothing disqualifies the result, except that another object may be the wanted one.
bool is_right_of_its_object(const RecordingResult& result);

// Whether an object's map is in several parts.
bool fell_apart(const RecordingResult& result);

// Whether the result has about as many images, or more.
bool is_most_of(const RecordingResult& result, const RecordingResult& before,
                const ResultChoiceOptions& options = {});

}  // namespace mono_pose_tracker
