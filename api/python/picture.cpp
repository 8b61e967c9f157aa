// Pictures as numpy arrays.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "api/python/bindings.h"
#include "engine/core/image_tools.h"
#include "engine/io/files.h"
#include "engine/io/png.h"

namespace halflight::python {
namespace {

/// Returns an image as an array of shape (height, width, channels), or (height, width) with one channel. It shares the
/// memory of the picture, which it keeps alive. Ids are returned as uint32 with the same bits.
py::array array_of(const Image& image, bool ids, const py::object& picture) {
    std::vector<py::ssize_t> shape{image.height, image.width};
    if (image.channels > 1) shape.push_back(image.channels);
    const py::dtype type = ids ? py::dtype::of<std::uint32_t>() : py::dtype::of<float>();
    return py::array(type, shape, image.pixels.data(), picture);
}

py::object layer(const py::object& self, const std::string& name) {
    const auto& p = self.cast<const PyPicture&>();
    if (name == "beauty") return array_of(p.result.beauty, false, self);
    if (name == "view") return array_of(p.result.view, false, self);
    for (std::size_t i = 0; i < p.layers.size(); ++i)
        if (p.layers[i] == name)
            return array_of(p.result.aovs[i].image, p.result.aovs[i].type == ExrType::uint32, self);
    throw py::key_error(name);
}

py::bytes png_of(const PyPicture& p) {
    const Image view = rgb(p.result.view);
    return py::bytes(encode_png("picture", view.width, view.height, view.channels, quantize_8bit(view), {}));
}

}  // namespace

void bind_picture(py::module_& module) {
    py::class_<PyPicture, std::shared_ptr<PyPicture>>(module, "Picture")
        .def_readonly("layers", &PyPicture::layers)
        .def_readonly("statistics", &PyPicture::statistics)
        .def_property_readonly("width", [](const PyPicture& p) { return p.result.beauty.width; })
        .def_property_readonly("height", [](const PyPicture& p) { return p.result.beauty.height; })
        .def_property_readonly("interrupted", [](const PyPicture& p) { return p.result.stats.interrupted; })
        .def("layer", &layer)
        .def("channels",
             [](const PyPicture& p, const std::string& name) -> std::vector<std::string> {
                 if (name == "beauty" || name == "view") return {"R", "G", "B", "A"};
                 for (std::size_t i = 0; i < p.layers.size(); ++i)
                     if (p.layers[i] == name) return p.result.aovs[i].channels;
                 throw py::key_error(name);
             })
        .def("png", &png_of)
        .def(
            "save",
            [](const PyPicture& p, const std::filesystem::path& path) {
                if (p.result.stats.interrupted) throw Error(path.string(), "not written: the picture was interrupted");
                make_folder_of(path);
                write_picture(path, p.result, p.info);
            },
            py::call_guard<Unlocked>());
}

}  // namespace halflight::python
