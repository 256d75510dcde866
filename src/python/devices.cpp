#include "raypager/devices.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "python/bindings.hpp"
#include "python/errors.hpp"

namespace nb = nanobind;

namespace raypager::python {

void add_devices(nb::module_& module) {
    nb::class_<DeviceInfo>(module, "Device", "An OpenCL device.")
        .def_ro("index", &DeviceInfo::index, "Its number, which the option `device` takes.")
        .def_ro("name", &DeviceInfo::name)
        .def_ro("platform", &DeviceInfo::platform)
        .def_ro("driver", &DeviceInfo::driver)
        .def_prop_ro(
            "type", [](const DeviceInfo& device) { return std::string(device_type_name(device.type)); }, "CPU, GPU or accelerator.")
        .def_ro("memory_bytes", &DeviceInfo::memory_bytes)
        .def_ro("max_allocation_bytes", &DeviceInfo::max_allocation_bytes)
        .def_ro("compute_units", &DeviceInfo::compute_units)
        .def_ro("is_default", &DeviceInfo::is_default, "Whether renders use it that name no other.")
        .def("__repr__", [](const DeviceInfo& device) {
            return "Device(" + std::to_string(device.index) + ", '" + device.name + "', '" + device.platform + "')";
        });
    module.def(
        "devices", [] { return value_of(without_gil([] { return list_devices(); })); }, "The OpenCL devices that there are.");
}

}  // namespace raypager::python
