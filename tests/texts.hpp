// What notices say, without what is for programs.
#pragma once

#include <string>
#include <vector>

#include "meniscus/notice.hpp"

namespace meniscus {

inline std::vector<std::string> texts(const std::vector<Notice>& notices) {
  std::vector<std::string> all;
  for (const Notice& notice : notices) all.push_back(to_string(notice));
  return all;
}

}  // namespace meniscus
