// Pages that need nothing else: style and pictures are part of them. Light and dark.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/printable.hpp"

namespace meniscus {

/// A whole page: `style` is CSS after the house's own, `body` the HTML between <main> and </main>.
std::string html_page(const std::string& title, const std::string& style, const std::string& body);

std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace meniscus
