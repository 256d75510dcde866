// Cameras, crops and pixel filters of pbrt scenes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "scene/projection.hpp"
#include "scene/vector.hpp"
#include "unit/pbrt_fixture.hpp"

namespace raypager {
namespace {

class ImportPbrtCameras : public test::PbrtTest {
protected:
    // 400 x 300 pixels, looking along +z from (0, 0, -5).
    Scene with(const std::string& camera, const std::string& film = "", const std::string& filter = "") {
        return expect_silence(text(camera, film, filter));
    }
    static std::string text(const std::string& camera, const std::string& film = "", const std::string& filter = "", const char* film_type = "rgb") {
        return fmt::format(
            "Film \"{}\" \"integer xresolution\" 400 \"integer yresolution\" 300 {}\n{}\nLookAt 0 0 -5  0 0 0  0 1 0\nCamera {}\nWorldBegin\n{}",
            film_type, film, filter, camera, test::one_triangle);
    }
};

void expect_near(const Float3& v, double x, double y, double z) {
    EXPECT_NEAR(v.x, x, 1e-5);
    EXPECT_NEAR(v.y, y, 1e-5);
    EXPECT_NEAR(v.z, z, 1e-5);
}

TEST_F(ImportPbrtCameras, Lenses) {
    const Camera c = with("\"perspective\" \"float lensradius\" 0.25 \"float focaldistance\" 7").camera;
    EXPECT_EQ(c.projection, Projection::perspective);
    EXPECT_EQ(c.lens_radius, 0.25f);
    EXPECT_EQ(c.focal_distance, 7);
    EXPECT_EQ(with("\"perspective\" \"float lensradius\" 0 \"float focaldistance\" 0").camera.lens_radius, 0);
    const Scene scaled =
        scene("Scale 2 2 2 LookAt 0 0 -5 0 0 0 0 1 0 Camera \"perspective\" \"float lensradius\" 1 \"float focaldistance\" 3 WorldBegin " +
              test::one_triangle);
    EXPECT_NEAR(scaled.camera.lens_radius, 0.5, 1e-6) << "the camera is half as large in the world";
    EXPECT_NEAR(scaled.camera.focal_distance * scaled.camera.forward.z, 1.5, 1e-6);
    expect_error(text("\"perspective\" \"float lensradius\" 0.25 \"float focaldistance\" 0"), "scene.pbrt:4:1: Camera: its focaldistance");
    expect_error(text("\"perspective\" \"float lensradius\" 1 \"float focaldistance\" 1e200"), "scene.pbrt:4:1: Camera: its focaldistance");
    expect_error(text("\"perspective\" \"float lensradius\" 1e200"), "scene.pbrt:4:1: Camera: its lensradius");
    expect_error(text("\"perspective\" \"float lensradius\" -1"), "scene.pbrt:4:1: Camera: its lensradius");
    expect_error(text("\"perspective\" \"float lensradius\" nan"), "scene.pbrt:4:");
    expect_warning("Scale 2 1 1 Camera \"perspective\" \"float lensradius\" 1 WorldBegin " + test::one_triangle, "stretches its lens");
}

TEST_F(ImportPbrtCameras, FramesOfPerspectives) {
    const Camera c = with("\"perspective\" \"float fov\" 90 \"float screenwindow\" [-1 0.5 -0.25 2]").camera;
    expect_near(c.right, 0.75, 0, 0);
    expect_near(c.up, 0, 1.125, 0);
    expect_near(c.forward, -0.25, 0.875, 1);
    const Camera wide = with("\"perspective\" \"float fov\" 90 \"float frameaspectratio\" 2").camera;
    expect_near(wide.right, 2, 0, 0);
    expect_near(wide.up, 0, 1, 0);
    const Camera tall = with("\"perspective\" \"float fov\" 90 \"float frameaspectratio\" 0.5").camera;
    expect_near(tall.right, 1, 0, 0);
    expect_near(tall.up, 0, 2, 0);
    EXPECT_LT(with("\"perspective\" \"float screenwindow\" [1 -1 -1 1]").camera.right.x, 0) << "mirrored";
    expect_near(with("\"perspective\" \"float halffov\" 45").camera.up, 0, 1, 0);
    expect_error(text("\"perspective\" \"float screenwindow\" [0 0 -1 1]"), "scene.pbrt:4:1: Camera: its screenwindow is empty");
    expect_error(text("\"perspective\" \"float screenwindow\" [0 1]"), "expected four numbers");
    expect_error(text("\"perspective\" \"float frameaspectratio\" 1e-300"), "scene.pbrt:4: Camera: its frame is too large");
    expect_error(text("\"perspective\" \"float frameaspectratio\" 0"), "scene.pbrt:4:1: Camera: its frameaspectratio");
}

TEST_F(ImportPbrtCameras, Orthographic) {
    const Camera c = with("\"orthographic\" \"float screenwindow\" [-3 1 -2 2]").camera;
    EXPECT_EQ(c.projection, Projection::orthographic);
    expect_near(c.eye, -1, 0, -5);
    expect_near(c.right, 2, 0, 0);
    expect_near(c.up, 0, 2, 0);
    expect_near(c.forward, 0, 0, 1);
    const Camera plain = with("\"orthographic\" \"float lensradius\" 1 \"float focaldistance\" 2").camera;
    expect_near(plain.right, 4.0 / 3, 0, 0);
    EXPECT_EQ(plain.focal_distance, 2);
}

TEST_F(ImportPbrtCameras, AllAround) {
    const Camera equal = with("\"spherical\"").camera;
    EXPECT_EQ(equal.projection, Projection::equal_area);
    EXPECT_EQ(with("\"spherical\" \"string mapping\" \"equirectangular\"").camera.projection, Projection::equirectangular);
    const Camera old = scene(text("\"environment\"", "", "", "image")).camera;
    EXPECT_EQ(old.projection, Projection::equirectangular);
    expect_near(old.right, 1, 0, 0);
    expect_near(old.up, 0, 1, 0);
    expect_near(old.forward, 0, 0, 1);
    // As in pbrt: the left border is +x of the camera, a quarter further +z; the top is +y.
    const auto towards = [](const Camera& c, double u, double v) { return float3(view_ray(c, u, v).direction); };
    expect_near(towards(old, 0, 0.5), 1, 0, 0);
    expect_near(towards(old, 0.25, 0.5), 0, 0, 1);
    expect_near(towards(old, 0.5, 0.5), -1, 0, 0);
    expect_near(towards(old, 0.3, 0), 0, 1, 0);
    expect_near(towards(equal, 0.5, 0.5), 0, 1, 0);
    expect_near(towards(equal, 1, 0.5), 1, 0, 0);
    expect_near(towards(equal, 0.5, 1), 0, 0, 1);
    expect_near(towards(equal, 0, 0), 0, -1, 0);
    expect_error(text("\"spherical\" \"string mapping\" \"mercator\""), "scene.pbrt:4:1: Camera: there is no mapping");
}

TEST_F(ImportPbrtCameras, OthersAreApproximated) {
    expect_warning(text("\"realistic\" \"string lensfile\" \"a.dat\""), "Camera \"realistic\" is not supported; a perspective camera is used");
}

// Of whatever camera, each pixel of a crop sees what it sees in the whole picture.
TEST_F(ImportPbrtCameras, CropsSeeWhatTheWholeSees) {
    for (const char* camera : {"\"perspective\" \"float fov\" 60", "\"orthographic\"", "\"spherical\"",
                               "\"spherical\" \"string mapping\" \"equirectangular\"", "\"perspective\" \"float screenwindow\" [-1 0.5 -0.25 2]"}) {
        SCOPED_TRACE(camera);
        const Scene whole = with(camera), part = with(camera, "\"float cropwindow\" [0.25 0.5 0.125 1]"),
                    same = with(camera, "\"integer pixelbounds\" [100 200 38 300]");
        EXPECT_EQ(part.width, 100u);
        EXPECT_EQ(part.height, 262u) << "pixels count by where they begin: 37.5 is in the one before";
        EXPECT_EQ(part.camera, same.camera);
        for (const auto& [x, y] : {std::pair(0.5, 0.5), {99.5, 0.5}, {31.25, 261.5}}) {
            const ViewRay a = view_ray(part.camera, x / 100, y / 262), b = view_ray(whole.camera, (x + 100) / 400, (y + 38) / 300);
            EXPECT_LT(length(a.origin - b.origin), 1e-5);
            EXPECT_LT(length(a.direction - b.direction), 1e-5);
        }
    }
}

TEST_F(ImportPbrtCameras, CropsThatGoTooFar) {
    EXPECT_EQ(expect_warning(text("\"perspective\"", "\"float cropwindow\" [0.5 2 0 1]"), "goes beyond the picture").width, 200u);
    EXPECT_EQ(expect_warning(text("\"perspective\"", "\"integer pixelbounds\" [-5 10 0 10]"), "goes beyond the picture").width, 10u);
    expect_warning(text("\"perspective\"", "\"integer pixelbounds\" [0 10 0 10] \"float cropwindow\" [0 1 0 1]"), "the latter count");
    expect_error(text("\"perspective\"", "\"float cropwindow\" [1.5 2 0 1]"), "scene.pbrt:1:1: Film: \"cropwindow\" leaves no pixels");
    expect_error(text("\"perspective\"", "\"float cropwindow\" [0.5 0.5 0 1]"), "leaves no pixels");
    expect_error(text("\"perspective\"", "\"integer pixelbounds\" [500 600 0 100]"), "scene.pbrt:1:1: Film: \"pixelbounds\" leaves no pixels");
    expect_error(text("\"perspective\"", "\"float cropwindow\" [0 1]"), "expected four numbers");
    expect_error(text("\"perspective\"", "\"float pixelbounds\" [0.5 3 0 1]"), "expected whole numbers");
    expect_error(text("\"perspective\"", "\"float cropwindow\" [0 1 0 nan]"), "scene.pbrt:1:");
}

TEST_F(ImportPbrtCameras, PixelFilters) {
    using Kind = PixelFilter::Kind;
    const auto filter = [&](const std::string& of, const char* film = "rgb") { return scene(text("\"perspective\"", "", of, film)).filter; };
    EXPECT_TRUE(filter("").is_the_pixel());
    EXPECT_TRUE(filter("", "image").is_the_pixel());
    EXPECT_TRUE(filter("PixelFilter \"box\"").is_the_pixel());
    EXPECT_EQ(filter("PixelFilter \"box\" \"float xwidth\" 1 \"float ywidth\" 2", "image"), (PixelFilter{Kind::box, 1, 2}));
    EXPECT_EQ(filter("PixelFilter \"triangle\""), (PixelFilter{Kind::triangle, 2, 2}));
    EXPECT_EQ(filter("PixelFilter \"gaussian\""), (PixelFilter{Kind::gaussian, 1.5f, 1.5f, 2}));
    EXPECT_EQ(filter("PixelFilter \"gaussian\" \"float sigma\" 1 \"float xradius\" 3"), (PixelFilter{Kind::gaussian, 3, 1.5f, 0.5f}));
    EXPECT_EQ(filter("PixelFilter \"gaussian\"", "image"), (PixelFilter{Kind::gaussian, 2, 2, 2}));
    EXPECT_EQ(filter("PixelFilter \"gaussian\" \"float alpha\" 1 \"float xwidth\" 3 \"float ywidth\" 3", "image"),
              (PixelFilter{Kind::gaussian, 3, 3, 1}));
    EXPECT_EQ(filter("PixelFilter \"mitchell\" \"float B\" 1 \"float C\" 0"), (PixelFilter{Kind::mitchell, 2, 2, 1, 0}));
    expect_silence(text("\"perspective\"", "", "PixelFilter \"mitchell\" \"float B\" 1 \"float C\" 0"));
    expect_silence(text("\"perspective\"", "", "PixelFilter \"gaussian\""));
    expect_warning(text("\"perspective\"", "", "PixelFilter \"mitchell\""),
                   "scene.pbrt:2: PixelFilter \"mitchell\" has negative lobes; they are left out");
    EXPECT_EQ(expect_warning(text("\"perspective\"", "", "PixelFilter \"sinc\""), "its main lobe is used").filter,
              (PixelFilter{Kind::sinc, 4, 4, 3}));
    EXPECT_TRUE(expect_warning(text("\"perspective\"", "", "PixelFilter \"fuzzy\""), "pixels are averaged with a box filter").filter.is_the_pixel());
}

TEST_F(ImportPbrtCameras, PixelFiltersThatLetNothingThrough) {
    for (const char* filter :
         {"\"box\" \"float xradius\" 0", "\"gaussian\" \"float xradius\" -1", "\"triangle\" \"float yradius\" 1e9", "\"gaussian\" \"float sigma\" 0",
          "\"gaussian\" \"float alpha\" -1", "\"mitchell\" \"float B\" 9", "\"sinc\" \"float tau\" 0"})
        expect_error(text("\"perspective\"", "", std::string("PixelFilter ") + filter), "scene.pbrt:2: PixelFilter: ");
    expect_error(text("\"perspective\"", "", "PixelFilter \"box\" \"float xradius\" nan"), "scene.pbrt:2:");
}

}  // namespace
}  // namespace raypager
