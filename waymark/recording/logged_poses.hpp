#pragma once

#include <functional>
#include <string>
#include <vector>

#include "waymark/recording/message_log.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// Whether the poses of a log are found among its samples: those of LCM and CSV, and of several files of
/// which none has messages of poses.
[[nodiscard]] bool poses_are_samples(const MessageLog& log);

/// The topics of a log whose messages are poses: nav_msgs/Odometry, geometry_msgs/PoseStamped and
/// PoseWithCovarianceStamped; where poses_are_samples() "/odom" and "/truth/pose", whether or not they
/// have any.
[[nodiscard]] std::vector<std::string> pose_topics(const MessageLog& log);

using PoseVisitor = std::function<Status(const EstimatedPose& pose)>;
/// Hears the log time of every message that is looked at.
using LogTimeVisitor = std::function<Status(std::uint64_t log_time)>;

/// Calls visit for each pose of one topic within the selection's times, in order of log time. Messages that
/// are damaged, or whose numbers are not finite, are passed over and noted. Fails when a visitor does.
[[nodiscard]] Status visit_poses(MessageLog& log, const std::string& topic, LogSelection selection,
                                 const PoseVisitor& visit, std::vector<LogProblem>& problems,
                                 const LogTimeVisitor& at = {});

}  // namespace waymark
