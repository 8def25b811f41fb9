#include "tests/benchmarks/vtk_peer.h"

#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSMPTools.h>
#include <vtkSTLWriter.h>
#include <vtkSmartPointer.h>

namespace volsmooth {

struct FlyingEdges::Pipeline {
  vtkSmartPointer<vtkImageData> image = vtkSmartPointer<vtkImageData>::New();
  vtkSmartPointer<vtkPolyData> surface;
};

FlyingEdges::FlyingEdges(const float* voxels, const std::array<std::int64_t, 3>& size)
    : pipeline_(std::make_unique<Pipeline>()) {
  const auto scalars = vtkSmartPointer<vtkFloatArray>::New();
  const vtkIdType kKeep = 1;
  scalars->SetArray(const_cast<float*>(voxels), size[0] * size[1] * size[2], kKeep);
  pipeline_->image->SetDimensions(static_cast<int>(size[0]), static_cast<int>(size[1]),
                                  static_cast<int>(size[2]));
  pipeline_->image->GetPointData()->SetScalars(scalars);
}

FlyingEdges::~FlyingEdges() = default;

std::int64_t FlyingEdges::extract(double isovalue, int threads) {
  pipeline_->surface = nullptr;
  const auto filter = vtkSmartPointer<vtkFlyingEdges3D>::New();
  filter->SetInputData(pipeline_->image);
  filter->SetValue(0, isovalue);
  filter->ComputeNormalsOn();
  filter->ComputeGradientsOff();
  filter->ComputeScalarsOff();
  vtkSMPTools::LocalScope(vtkSMPTools::Config{threads}, [&] { filter->Update(); });
  pipeline_->surface = filter->GetOutput();
  return pipeline_->surface->GetNumberOfCells();
}

void FlyingEdges::write_stl(const std::string& file) const {
  const auto writer = vtkSmartPointer<vtkSTLWriter>::New();
  writer->SetInputData(pipeline_->surface);
  writer->SetFileTypeToBinary();
  writer->SetFileName(file.c_str());
  writer->Write();
}

}  // namespace volsmooth
