#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <functional>

#include "tests/support/dicom_maker.h"
#include "tests/system/nifti_bytes.h"
#include "tests/system/planted_names.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {
namespace {

namespace fs = std::filesystem;

TEST(Privacy, NobodyElseMayReadAnythingThatIsStored) {
  const mode_t before = ::umask(022);
  const Daemon daemon(VOLSMOOTHD);
  ::umask(before);
  (void)ServiceClient(daemon).upload(ball_file(16));

  // Each entry by itself: the folder around them may be one that was there before, and open to all.
  int entries = 0;
  for (const auto& entry : fs::recursive_directory_iterator(daemon.data())) {
    ++entries;
    EXPECT_EQ(entry.status().permissions() & (fs::perms::group_all | fs::perms::others_all), fs::perms::none)
        << entry.path();
  }
  EXPECT_GT(entries, 0);
}

TEST(Privacy, ThePlantedNamesWouldBeFoundInEveryForm) {
  using Names = PlantedNames;
  const std::string letters = Names::core(37), name = Names::name(37);
  for (const std::string& form :
       {name, Names::escaped(name), Names::wide(name, false), Names::wide(name, true), Names::hex(name),
        Names::base64(name), Names::base64("x" + name), Names::base64("xy" + name)})
    EXPECT_TRUE(Names::is_in("before " + form + " after", letters)) << form;
  EXPECT_FALSE(Names::is_in(Names::name(38) + Names::base64(Names::name(36)), letters));
}

/// Where clients put the names of patients, on purpose or not; each place takes one.
class Planting {
 public:
  explicit Planting(const Daemon& daemon)
      : service_(daemon),
        volume_(service_.upload(ball_file(8)).at("id")),
        job_(service_.run(order()).at("id")) {}

  void plant(int number) {
    places_[static_cast<std::size_t>(number) % places_.size()](PlantedNames::name(number));
  }
  /// Everything that was said to a client that was refused.
  const std::string& refusals() const { return refusals_; }

 private:
  using Place = std::function<void(const std::string& name)>;

  json order(const std::string& member = {}, const json& value = {}) const {
    json wanted = {{"volume", volume_}, {"isovalues", json::array()}};
    if (!member.empty()) wanted[member] = value;
    return wanted;
  }
  void call(const std::string& method, const std::string& target, const std::string& body = {},
            const HeaderFields& fields = {}) {
    const HttpResponse answer = service_.call(method, target, body, fields);
    if (answer.status < 400) return;
    refusals_ += answer.body;
    for (const auto& [field, value] : answer.headers) refusals_ += field + ": " + value + "\n";
  }
  void submit(const json& order) {
    call("POST", "/v1/jobs", order.dump(), {{"Content-Type", "application/json"}});
  }
  void upload_dicom(std::uint32_t tag, const std::string& vr, const std::string& name,
                    const std::string& query = {}) {
    auto slices = series_of({.columns = 8, .rows = 8, .slices = 4});
    for (DicomDataset& slice : slices) slice.text(tag, vr, name);
    call("POST", "/v1/volumes" + query, zip_of(files_of(slices)));
  }
  static std::string with_extension(const std::string& text) {
    Bytes file = edited(ball_file(8), {put(nifti1::kVoxOffset, 352.F + 64), put(nifti1::kExtender, char{1})});
    return file.insert(nifti1::kData, bytes_of(std::int32_t{64}) + bytes_of(std::int32_t{6}) +
                                          (text + std::string(56, ' ')).substr(0, 56));
  }

  ServiceClient service_;
  std::string volume_, job_, refusals_;
  const std::vector<Place> places_ = {
      [this](const auto& name) {
        const std::string id = service_.upload(edited(ball_file(8), {{nifti1::kDescrip, name}})).at("id");
        service_.run({{"volume", id}});
      },
      [this](const auto& name) {
        call("POST", "/v1/volumes", edited(ball_file(8), {{nifti1::kAuxFile, name.substr(0, 23)}}));
      },
      [this](const auto& name) { call("POST", "/v1/volumes", with_extension(name)); },
      [this](const auto& name) { call("POST", "/v1/volumes", with_extension(name).substr(0, 500)); },
      [this](const auto& name) { call("POST", "/v1/volumes", name); },
      [this](const auto& name) { call("POST", "/v1/volumes", gzip(name)); },
      [this](const auto& name) { call("POST", "/v1/volumes", zip_of({name})); },
      [this](const auto& name) { upload_dicom(0x00100010, "PN", name); },
      [this](const auto& name) { upload_dicom(0x00100020, "LO", name); },
      [this](const auto& name) { upload_dicom(0x00080080, "LO", name); },
      [this](const auto& name) { upload_dicom(0x00081030, "LO", name); },
      [this](const auto& name) { upload_dicom(0x00280004, "CS", name); },  // refused: no such photometric
      [this](const auto& name) { upload_dicom(0x0020000E, "UI", name); },
      [this](const auto& name) { upload_dicom(0x00280030, "DS", name); },
      [this](const auto& name) {
        call("POST", "/v1/volumes?series=" + PlantedNames::escaped(name), ball_file(8));
      },
      [this](const auto& name) {
        call("POST", "/v1/volumes?non_finite=" + PlantedNames::escaped(name), ball_file(8));
      },
      [this](const auto& name) { service_.run(order("label", name)); },
      [this](const auto& name) { submit(order("label", std::string(200, 'x') + name)); },
      [this](const auto& name) { submit(order("method", name)); },
      [this](const auto& name) { submit(order("isovalues", name)); },
      [this](const auto& name) { submit(order("mesh_formats", {name})); },
      [this](const auto& name) { submit(order("destination", name)); },
      [this](const auto& name) {
        submit(order("source", {{"dicomweb", name}, {"study", name}, {"series", name}}));
      },
      [this](const auto& name) {
        submit(order("parameters", {{name, 1}}));
      },
      [this](const auto& name) { submit(order(name, 1)); },
      [this](const auto& name) {
        submit({{"volume", name}});
      },
      [this](const auto& name) {
        call("POST", "/v1/jobs", "{\"" + name, {{"Content-Type", "application/json"}});
      },
      [this](const auto& name) {
        call("POST", "/v1/jobs", "{}", {{"Content-Type", "application/" + name.substr(0, 14)}});
      },
      [this](const auto& name) { call("GET", "/v1/jobs?label=" + PlantedNames::escaped(name)); },
      [this](const auto& name) { call("GET", "/v1/jobs?state=" + PlantedNames::escaped(name)); },
      [this](const auto& name) { call("GET", "/v1/jobs?cursor=" + PlantedNames::escaped(name)); },
      [this](const auto& name) { call("GET", "/v1/jobs?" + PlantedNames::escaped(name) + "=1"); },
      [this](const auto& name) { call("GET", "/v1/jobs/" + PlantedNames::escaped(name)); },
      [this](const auto& name) { call("GET", "/v1/jobs/" + name.substr(0, 14)); },
      [this](const auto& name) { call("GET", "/v1/jobs/" + name); },
      [this](const auto& name) { call("DELETE", "/v1/volumes/" + name.substr(0, 14)); },
      [this](const auto& name) { call("GET", "/v1/jobs/" + job_ + "/results/" + name.substr(0, 14)); },
      [this](const auto& name) { call("GET", "/" + name.substr(0, 14)); },
      [this](const auto& name) { call("POST", "/dicomweb/" + name.substr(0, 14) + "/studies", "x"); },
      [this](const auto& name) { call(name.substr(0, 14), "/v1/jobs"); },
      [this](const auto& name) {
        call("GET", "/v1/jobs", "", {{"User-Agent", name}});
      },
      [this](const auto& name) {
        call("GET", "/v1/jobs", "", {{"Authorization", "Bearer volsmooth_" + name.substr(0, 14) + "_x"}});
      },
      [this](const auto& name) {
        call("GET", "/v1/jobs", "", {{"Host", name.substr(0, 14)}});
      },
      [this](const auto& name) {
        call("GET", "/v1/jobs", "", {{"Origin", "http://" + name.substr(0, 14)}});
      },
      [this](const auto& name) {
        call("GET", "/v1/jobs", "", {{"Accept", name.substr(0, 14) + "/x"}});
      },
      [this](const auto& name) {
        call("GET", "/v1/jobs/" + job_ + "/results/report.json", "", {{"Range", name}});
      },
      [this](const auto& name) {
        call("GET", "/v1/jobs/" + job_ + "/results/report.json", "", {{"If-Range", '"' + name + '"'}});
      },
      [this](const auto& name) {
        call("POST", "/v1/volumes", ball_file(8), {{"Idempotency-Key", name}});
      },
      [this](const auto& name) {
        call("POST", "/v1/volumes", ball_file(8), {{"Content-Digest", name}});
      },
      [this](const auto& name) {
        call("POST", "/v1/volumes",
             "--b\r\nContent-Disposition: form-data; name=\"volume\"; filename=\"" + name + "\"\r\n\r\n" +
                 ball_file(8) + "\r\n--b--\r\n",
             {{"Content-Type", "multipart/form-data; boundary=b"}});
      }};
};

/// 100 names, twice in each of fifty places: none of them in a log, a metric, the document of an error, the
/// audit, or the name of a file.
TEST(Privacy, NamesOfPatientsAreNowhereButInWhatTheyCameWith) {
  constexpr int kNames = 100;
  const Daemon daemon(VOLSMOOTHD, {"--log-level", "debug"});
  Planting planting(daemon);
  for (int number = 0; number < kNames; ++number) planting.plant(number);

  std::map<std::string, std::string> places = {{"log", daemon.log()}, {"refusals", planting.refusals()}};
  places["metrics"] = ServiceClient(daemon).call("GET", "/metrics").body;
  for (const auto& entry : fs::recursive_directory_iterator(daemon.data()))
    places["file names"] += entry.path().string() + '\n';
  const TemporaryDirectory folder;
  ASSERT_EQ(ChildProcess({VOLSMOOTHD, "audit", "export", "--data", daemon.data().string()}, folder / "audit",
                         folder / "error")
                .wait(),
            0);
  places["audit"] = content_of(folder / "audit");
  for (const auto& [place, text] : places) {
    EXPECT_GT(text.size(), 100U) << place;
    for (int number = 0; number < kNames; ++number)
      EXPECT_FALSE(PlantedNames::is_in(text, PlantedNames::core(number)))
          << place << ", " << number << " of " << kNames;
  }
}

}  // namespace
}  // namespace volsmooth::test
