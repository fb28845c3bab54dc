#pragma once

#include <ros/node_handle.h>
#include <ros/single_subscriber_publisher.h>

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "ros/guard.h"

namespace mono_pose_tracker {

/// A latched topic whose message is made for subscribers only: a new subscriber gets the present one.
/// roscpp's own latch would have to be updated without subscribers, or would send an outdated message,
/// perhaps of a deleted map.
template <typename Message>
class OnDemandPublisher {
 public:
  using Make = std::function<std::optional<Message>()>;  // nothing: there is none yet
  using Tell = std::function<void(const std::string&)>;  // what went wrong for a new subscriber

  /// make and tell are called by the handle's queue, make by publish() as well.
  OnDemandPublisher(ros::NodeHandle handle, const std::string& topic, Make make, Tell tell)
      : make_(std::move(make)), tell_(std::move(tell)) {
    const ros::SubscriberStatusCallback welcome = [this](const ros::SingleSubscriberPublisher& subscriber) {
      guarded(
          [&] {
            if (const std::optional<Message> message = make_()) subscriber.publish(*message);
          },
          tell_);
    };
    constexpr bool kLatched = true;
    latch_ = handle.advertise<Message>(topic, 1, kLatched);
    publisher_ = handle.advertise<Message>(topic, 1, welcome);
  }
  /// Returns when a running callback has ended.
  ~OnDemandPublisher() {
    publisher_.shutdown();
    latch_.shutdown();
  }
  OnDemandPublisher(const OnDemandPublisher&) = delete;
  OnDemandPublisher& operator=(const OnDemandPublisher&) = delete;

  /// Publishes to all subscribers; nothing is made without one.
  void publish() const {
    if (publisher_.getNumSubscribers() == 0) return;
    if (const std::optional<Message> message = make_()) publisher_.publish(*message);
  }

 private:
  const Make make_;
  const Tell tell_;
  ros::Publisher publisher_;
  /// Of the same topic, and nothing is ever published with it, so that it keeps nothing: it makes the topic
  /// say that it is latched, as a process must know in which a second subscriber shares the first one's
  /// connection.
  ros::Publisher latch_;
};

}  // namespace mono_pose_tracker
