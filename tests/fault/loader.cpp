// The loader's books on schedules that are rare otherwise.
#include "residency/loader.hpp"

#include <gtest/gtest.h>

#include <semaphore>

#include "support/small_scene_file.hpp"

namespace raypager {
namespace {

// The first thread stays behind once it has given its upload away; the second one waits before it does so.
class LateThread final : public DeviceHooks {
public:
    void before_upload() override {
        if (++begun_ == 2) second_may_go_on.acquire();
    }
    void after_upload() override {
        if (++ended_ == 1) first_may_go_on.acquire();
    }
    std::binary_semaphore first_may_go_on{0}, second_may_go_on{0};

private:
    std::atomic<int> begun_{0}, ended_{0};
};

using LoaderOnDevice = support::SmallSceneFile;

// A block may come, leave and be wanted again before the thread that brought it goes on: that must not count the second load as done, or rays would
// wait for a block that nobody is said to bring.
TEST_F(LoaderOnDevice, a_late_thread_forgets_no_load_of_another) {
    const auto hooks = std::make_shared<LateThread>();
    auto device = Device::open("", 0, {}, hooks);
    ASSERT_TRUE(device.ok()) << device.status().message();
    if (!(*device)->thread_safe()) GTEST_SKIP() << "no threads on this device";
    HostCache cache(**device, *file_, support::default_form(), uint64_t{1} << 30);
    std::vector<Buffer> slabs;
    auto slab = (*device)->allocate(file_->scene().largest_block(support::default_form()), "a slab");
    ASSERT_TRUE(slab.ok()) << slab.status().message();
    slabs.push_back(std::move(*slab));
    const auto loader = Loader::create(**device, cache, slabs, 2);
    const std::vector<PlannedLoad> load = {{0, {0, 0}}};
    loader->start(load, Event(), Event());
    for (bool came = false; !came;) {  // without waiting for the thread, which would wake this one
        const auto first = loader->arrived(false);
        ASSERT_TRUE(first.ok()) << first.status().message();
        came = !first->empty();
    }
    loader->start(load, Event(), Event());
    while (!loader->to_begin().empty()) std::this_thread::yield();
    hooks->first_may_go_on.release();
    for (int i = 0; i < 100 && loader->under_way() == 1; i++) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_EQ(loader->under_way(), 1u);
    hooks->second_may_go_on.release();
    const auto second = loader->arrived(true);
    ASSERT_TRUE(second.ok());
    EXPECT_EQ(second->size(), 1u);
    EXPECT_EQ(loader->under_way(), 0u);
}

}  // namespace
}  // namespace raypager
