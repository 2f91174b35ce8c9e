// Tables, Markdown, HTML and pictures.
#include "accuracy/report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include "accuracy/error_map.hpp"
#include "accuracy/results.hpp"
#include "accuracy/synthetic.hpp"

namespace meniscus::accuracy {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

Table::Line line(Better better, std::vector<double> values) {
  return {{"normal_rms", "s", 2, better, "How far."}, std::move(values)};
}

TEST(BestOf, FollowsWhatIsGood) {
  EXPECT_THAT(best_of(line(Better::low, {3, 1, 2})), ElementsAre(false, true, false));
  EXPECT_THAT(best_of(line(Better::high, {3, 1, 2})), ElementsAre(true, false, false));
  EXPECT_THAT(best_of(line(Better::near_zero, {-1, 2, -3})), ElementsAre(true, false, false));
  EXPECT_THAT(best_of(line(Better::neither, {1, 2, 3})), ElementsAre(false, false, false));
}

TEST(BestOf, SeesWhatIsShown) {
  EXPECT_THAT(best_of(line(Better::low, {1.001, 1.002, 2})), ElementsAre(true, true, false));
  EXPECT_THAT(best_of(line(Better::low, {1.001, 1.002})), ElementsAre(false, false))
      << "nobody is better";
  EXPECT_THAT(best_of(line(Better::low, {kNone, 1, 2})), ElementsAre(false, true, false));
}

Report small_report() {
  Report report;
  report.title = "A <title> & more";
  report.facts = {{"seeds", "1"}};
  report.tables = {{"Mean", "", {"fit", "ssm"}, {line(Better::low, {1, kNone})}, "figure"}};
  report.tables[0].lines.push_back(line(Better::low, {0.25, 0.5}));
  return report;
}

TEST(Markdown, HasTheTables) {
  EXPECT_EQ(markdown(small_report()),
            "- seeds: 1\n\n#### Mean\n\n| figure | unit | `fit` | `ssm` |\n|---|---|--:|--:|\n"
            "| normal_rms | s | 1.00 | – |\n| normal_rms | s | **0.25** | 0.50 |\n");
}

TEST(Html, IsOnePageWithAllInIt) {
  Report report = small_report();
  report.galleries.push_back(
      {"Pictures", "", "errors", "normals", {{"box", {{"fit", {'a', 'b', 'c'}, {'d'}}}}}});
  const std::string page = html(report);
  EXPECT_THAT(page, HasSubstr("A &lt;title&gt; &amp; more"));
  EXPECT_THAT(page, HasSubstr("<td class=\"best\">0.25</td>"));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,YWJj\""));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,ZA==\""));
  for (const char* outside : {"http:", "https:", "url(", "@import", "<link"})
    EXPECT_THAT(page, Not(HasSubstr(outside)));
}

Row row(const std::string& setting, const std::string& scene, const std::string& method,
        double rms) {
  Row result{setting, setting, scene, method, false, {}, 1};
  result.figures.normal_rms = rms;
  return result;
}

TEST(Tables, ShowTheScenesOfOneSetting) {
  const std::vector<Row> rows{row("main", "box", "fit", 1),  row("main", "ball", "fit", 2),
                              row("main", kMean, "fit", 3),  row("main", "box", "ssm", 4),
                              row("main", "ball", "ssm", 5), row("main", kMean, "ssm", 6)};
  Report report;
  add_tables(rows, report);
  ASSERT_EQ(report.tables.size(), 2u);
  EXPECT_EQ(report.tables[0].title, "Mean over the scenes");
  EXPECT_THAT(report.tables[0].columns, ElementsAre("fit", "ssm"));
  ASSERT_EQ(report.tables[0].lines.size(), 2u) << "what is not measured is left out";
  EXPECT_THAT(report.tables[0].lines[0].values, ElementsAre(3, 6));
  EXPECT_EQ(report.tables[0].lines[1].quantity.name, "time");
  EXPECT_EQ(report.tables[1].title, "normal_rms");
  EXPECT_EQ(report.tables[1].lines[1].quantity.name, "ball");
  EXPECT_THAT(report.tables[1].lines[1].values, ElementsAre(2, 5));
  EXPECT_EQ(report.details.size(), 2u) << "two scenes";
}

TEST(Tables, NameTheWorstSceneBesideTheMean) {
  Row box = row("main", "box", "fit", 1), ball = row("main", "ball", "fit", 3);
  box.figures.iou = 0.5;
  ball.figures.iou = 0.75;
  box.figures.normal_bias = -0.5;
  ball.figures.normal_bias = 0.25;
  const Row both = mean_of({box, ball}, kMean);
  Report report;
  add_tables({box, ball, both}, report);
  const auto shown_of = [&](const std::string& name) {
    for (const Table::Line& line : report.tables[0].lines)
      if (line.quantity.name == name) return line.worst.at(0);
    return std::string("no line");
  };
  EXPECT_EQ(shown_of("normal_rms"), "3.0000 ball");
  EXPECT_EQ(shown_of("iou"), "0.5000 box") << "low ones are worse";
  EXPECT_EQ(shown_of("normal_bias"), "-0.5000 box") << "far from zero is worse";
  EXPECT_THAT(markdown(report), HasSubstr("| normal_rms | s | 2.0000 (3.0000 ball) |"));
  EXPECT_THAT(html(report), HasSubstr("<div class=\"worst\">3.0000 ball</div>"));
  EXPECT_EQ(to_json(both)["worst"]["iou"]["scene"], "box");
  EXPECT_TRUE(mean_of({box, box}, "box").worst.empty()) << "seeds of one scene";
}

TEST(Tables, ShowTheMeansOfSeveralSettings) {
  const std::vector<Row> rows{row("main", "box", "fit", 1), row("main", kMean, "fit", 3),
                              row("wide", "box", "fit", 5), row("wide", kMean, "fit", 7)};
  Report report;
  add_tables(rows, report);
  ASSERT_EQ(report.tables.size(), 1u);
  EXPECT_EQ(report.tables[0].lines[0].quantity.name, "main");
  EXPECT_THAT(report.tables[0].lines[1].values, ElementsAre(7));
  EXPECT_EQ(report.details.size(), 4u);
}

TEST(Figures, EveryOneIsNamedOnceAndExplained) {
  std::vector<std::string> names;
  for (const FigureField& field : figure_fields()) {
    EXPECT_THAT(names, Not(testing::Contains(field.name)));
    names.push_back(field.name);
    EXPECT_THAT(field.meaning, testing::EndsWith("."));
  }
  // Each is a double of its own: none of the struct is left out of the tables.
  EXPECT_EQ(names.size(), sizeof(Figures) / sizeof(double));
}

/// The colours of a PNG.
std::vector<Rgb> decoded(const Bytes& png) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(png_image_begin_read_from_memory(&image, png.data(), png.size()));
  image.format = PNG_FORMAT_RGB;
  std::vector<Rgb> pixels(static_cast<std::size_t>(image.width) * image.height);
  EXPECT_TRUE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr));
  return pixels;
}

TEST(ErrorMap, HasTheColoursOfItsLegend) {
  const Truth truth = wall([](int x, int) { return x != 3 && x != 4; }, PixelClass::interior);
  Map map = map_of(truth);
  map.depth[0] -= 5;                            // in front
  map.depth[1] += 0.1f;                         // behind by half of the full colour
  map.depth[2] = static_cast<float>(kNothing);  // missing
  map.depth[3] = kWall;                         // too much
  const std::vector<Rgb> colors = decoded(error_map(truth, map));
  ASSERT_EQ(colors.size(), map.depth.size());
  EXPECT_EQ(colors[0], (Rgb{190, 0, 20}));
  EXPECT_EQ(colors[1], (Rgb{128, 153, 223}));
  EXPECT_EQ(colors[2], (Rgb{0, 150, 60}));
  EXPECT_EQ(colors[3], (Rgb{255, 215, 0}));
  EXPECT_EQ(colors[4], (Rgb{80, 80, 80}));
  EXPECT_EQ(colors[5], (Rgb{255, 255, 255}));
}

}  // namespace
}  // namespace meniscus::accuracy
