#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// A participant as ROS 2 nodes are, over UDP alone, with the interfaces and peers of the options.
[[nodiscard]] eprosima::fastdds::dds::DomainParticipantQos participant_qos(const BusOptions& options);
[[nodiscard]] eprosima::fastdds::dds::DataWriterQos writer_qos(const TopicQos& qos);
[[nodiscard]] eprosima::fastdds::dds::DataReaderQos reader_qos(const TopicQos& qos);

}  // namespace waymark
