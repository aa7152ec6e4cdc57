#pragma once

#include <cstdint>
#include <memory>

#include "waymark/base/error.hpp"
#include "waymark/families/family.hpp"
#include "waymark/tags/detector.hpp"

namespace waymark {

/// A detector implemented with libapriltag 3.3. Fails with InvalidArgument if a value is out of range or a
/// family is unknown, and with LimitExceeded if the tables would exceed memory_limit_mib. Creation takes
/// milliseconds for tag36h11 and up to a second for the largest families.
///
/// detect() works directly on images of any stride, unless quad_sigma requires a copy. It needs about 12
/// bytes of memory per pixel, and up to 60 if the image is noise. Images larger than kMaxImagePixels are
/// rejected. Thread-safe: each concurrent call uses a separate workspace, which is kept for later calls.
[[nodiscard]] Result<std::unique_ptr<Detector>> make_apriltag_detector(const DetectorOptions& options = {});

/// Size in bytes of the decoding table of one family with `max_hamming` corrected bits (0 to 2). The table
/// contains every code with every pattern of wrong bits.
[[nodiscard]] std::int64_t decode_table_bytes(const Family& family, int max_hamming);

}  // namespace waymark
