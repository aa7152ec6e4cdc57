#include "waymark/app/common/wrong_size_fields.hpp"

namespace waymark {

ReportFields fields(const WrongSize& size) {
  return {{"tag", "Tag", to_string(size.tag)},
          {"given_m", "Given side of the black square", size.given_m},
          {"found_m", "Side that fits the observations", size.found_m},
          {"sigma_m", "Standard deviation of found_m", size.sigma_m},
          {"deviations", "Deviation of the given size, in standard deviations", size.deviations}};
}

}  // namespace waymark
