#include "verify/flaws.hpp"

#include <array>
#include <string>

#include "verify/program.hpp"

namespace meniscus::verify {
namespace {

constexpr std::array kFlaws{"array_of_structs",       "fma_of_zero",
                            "not_of_lanes",           "sixteen_floats",
                            "struct_through_pointer", "zero_minus"};

}  // namespace

std::vector<Item> flaw_items() {
  std::vector<Item> items;
  for (const std::string flaw : kFlaws)
    items.push_back({"flaw", flaw, "", "docs/runtime_flaws", false,
                     [flaw](Device& device, const Report& report) {
                       const std::string manifest = flaw + ".json";
                       const Program program =
                           program_of(std::string(flaw_file(flaw + ".cl")),
                                      {manifest, std::string(flaw_file(manifest))});
                       run_program(device, program, "flaw", [&](Row row) {
                         row.required = false;
                         report(std::move(row));
                       });
                     }});
  return items;
}

}  // namespace meniscus::verify
