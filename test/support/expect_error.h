#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <stdexcept>
#include <string>

namespace mono_pose_tracker {

/// Expects `action` to throw an Error whose message is one line that holds every one of `parts`.
template <typename Error = std::runtime_error, typename Action>
void expect_error(const Action& action, std::initializer_list<std::string> parts) {
  try {
    action();
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    for (const std::string& part : parts) {
      EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is not in: " << message;
    }
    return;
  }
  ADD_FAILURE() << "nothing was thrown, expected an error with '" << *parts.begin() << "'";
}

}  // namespace mono_pose_tracker
