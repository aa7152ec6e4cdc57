#include "waymark/robots/fastdds/raw_cdr.hpp"

#include <cstring>

namespace waymark {
namespace {

constexpr std::uint32_t kInitialSize = 1024;  // what histories begin with; they grow
constexpr std::size_t kEncapsulation = 4;

RawCdr& raw(void* data) { return *static_cast<RawCdr*>(data); }

}  // namespace

RawCdrType::RawCdrType(const std::string& dds_name) {
  setName(dds_name.c_str());
  m_typeSize = kInitialSize;
  m_isGetKeyDefined = false;
  auto_fill_type_information(false);
  auto_fill_type_object(false);
}

bool RawCdrType::serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) {
  const std::vector<std::uint8_t>& bytes = raw(data).bytes;
  if (bytes.size() < kEncapsulation || payload->max_size < bytes.size()) return false;
  std::memcpy(payload->data, bytes.data(), bytes.size());
  payload->length = static_cast<std::uint32_t>(bytes.size());
  payload->encapsulation = (bytes[1] & 1U) != 0 ? CDR_LE : CDR_BE;
  return true;
}

bool RawCdrType::deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) {
  raw(data).bytes.assign(payload->data, payload->data + payload->length);
  return true;
}

std::function<std::uint32_t()> RawCdrType::getSerializedSizeProvider(void* data) {
  return [data] { return static_cast<std::uint32_t>(raw(data).bytes.size()); };
}

void* RawCdrType::createData() { return new RawCdr; }

void RawCdrType::deleteData(void* data) { delete static_cast<RawCdr*>(data); }

bool RawCdrType::getKey(void* /*data*/, eprosima::fastrtps::rtps::InstanceHandle_t* /*handle*/,
                        bool /*force_md5*/) {
  return false;
}

}  // namespace waymark
