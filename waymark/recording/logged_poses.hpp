#pragma once

#include <functional>
#include <string>
#include <vector>

#include "waymark/recording/message_log.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// Whether the poses in a log are samples rather than messages. This is so in LCM and CSV logs, and in merged
/// logs without pose messages.
[[nodiscard]] bool poses_are_samples(const MessageLog& log);

/// The topics in a log whose messages are poses: nav_msgs/Odometry, geometry_msgs/PoseStamped and
/// PoseWithCovarianceStamped. If poses_are_samples(), these are "/odom" and "/truth/pose", even if they are
/// empty.
[[nodiscard]] std::vector<std::string> pose_topics(const MessageLog& log);

using PoseVisitor = std::function<Status(const EstimatedPose& pose)>;
/// Receives the log time of every message that is read.
using LogTimeVisitor = std::function<Status(std::uint64_t log_time)>;

/// Calls `visit` for each pose on one topic within the selected times, in order of log time. Messages that
/// are damaged or non-finite are skipped and noted. Fails if a visitor fails.
[[nodiscard]] Status visit_poses(MessageLog& log, const std::string& topic, LogSelection selection,
                                 const PoseVisitor& visit, std::vector<LogProblem>& problems,
                                 const LogTimeVisitor& at = {});

}  // namespace waymark
