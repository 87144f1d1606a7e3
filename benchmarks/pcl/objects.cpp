// SPDX-FileCopyrightText: 2026 topo_region_seg contributors
// SPDX-License-Identifier: Apache-2.0
// objects METHOD VALUE POINTS PLANE SMALLEST LABELS
//   POINTS: rows of x, y, z (m) float32 and the bits of 0x00RRGGBB, in the sensor frame, all finite. The plane with most
//   inliers within PLANE (m) is removed first; 0 = none is. METHOD is one of these:
//   lccp: VCCS supervoxels of voxels of VALUE (m), seeds four times as far apart, no color, united by local convexity;
//   region_growing: normals from 30 points, angles to VALUE (degrees), curvature to 1;
//   clusters: Euclidean clusters of points up to VALUE (m) apart.
//   Writes each point's object, counted from 1, 0 = none or fewer than SMALLEST points (int32). The time is the
//   processor's, all threads together.

#include <cmath>
#include <cstring>
#include <ctime>
#include <map>
#include <pcl/features/normal_3d_omp.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/lccp_segmentation.h>
#include <pcl/segmentation/region_growing.h>
#include <pcl/segmentation/sac_segmentation.h>
#include <pcl/segmentation/supervoxel_clustering.h>

#include "exchange.hpp"

namespace {

using Point = pcl::PointXYZRGBA;
using Cloud = pcl::PointCloud<Point>;
using Labels = std::vector<std::uint32_t>;

pcl::IndicesPtr off_plane(const Cloud::Ptr& cloud, float distance) {
  auto kept = std::make_shared<pcl::Indices>();
  pcl::PointIndices inliers;
  if (distance > 0.0f) {
    pcl::ModelCoefficients plane;
    pcl::SACSegmentation<Point> segmentation;
    segmentation.setOptimizeCoefficients(true);
    segmentation.setModelType(pcl::SACMODEL_PLANE);
    segmentation.setMethodType(pcl::SAC_RANSAC);
    segmentation.setDistanceThreshold(distance);
    segmentation.setInputCloud(cloud);
    segmentation.segment(inliers, plane);
  }
  std::vector<bool> on(cloud->size(), false);
  for (const auto point : inliers.indices) on[point] = true;
  for (std::size_t i = 0; i < cloud->size(); ++i)
    if (!on[i]) kept->push_back(static_cast<pcl::index_t>(i));
  return kept;
}

Labels numbered(const std::vector<pcl::PointIndices>& groups, std::size_t count) {
  Labels labels(count, 0);
  for (std::size_t group = 0; group < groups.size(); ++group)
    for (const auto point : groups[group].indices) labels[point] = static_cast<std::uint32_t>(group) + 1;
  return labels;
}

Labels lccp(const Cloud::Ptr& cloud, float voxel, int) {
  const float seed = 4.0f * voxel;
  pcl::SupervoxelClustering<Point> clustering(voxel, seed);
  clustering.setUseSingleCameraTransform(false);
  clustering.setInputCloud(cloud);
  clustering.setColorImportance(0.0f);
  clustering.setSpatialImportance(1.0f);
  clustering.setNormalImportance(4.0f);
  std::map<std::uint32_t, pcl::Supervoxel<Point>::Ptr> patches;
  clustering.extract(patches);
  std::multimap<std::uint32_t, std::uint32_t> adjacency;
  clustering.getSupervoxelAdjacency(adjacency);
  pcl::LCCPSegmentation<Point> segmentation;
  segmentation.setConcavityToleranceThreshold(10.0f);
  segmentation.setSanityCheck(true);
  segmentation.setSmoothnessCheck(true, voxel, seed, 0.1f);
  segmentation.setKFactor(0);
  segmentation.setInputSupervoxels(patches, adjacency);
  segmentation.segment();
  auto labeled = clustering.getLabeledCloud();
  segmentation.relabelCloud(*labeled);
  Labels labels(cloud->size(), 0);
  for (std::size_t i = 0; i < cloud->size(); ++i) labels[i] = (*labeled)[i].label;
  return labels;
}

Labels region_growing(const Cloud::Ptr& cloud, float angle, int smallest) {
  auto tree = std::make_shared<pcl::search::KdTree<Point>>();
  auto normals = std::make_shared<pcl::PointCloud<pcl::Normal>>();
  pcl::NormalEstimationOMP<Point, pcl::Normal> estimation;
  estimation.setSearchMethod(tree);
  estimation.setInputCloud(cloud);
  estimation.setKSearch(30);
  estimation.compute(*normals);
  pcl::RegionGrowing<Point, pcl::Normal> growing;
  growing.setMinClusterSize(smallest);
  growing.setSearchMethod(tree);
  growing.setNumberOfNeighbours(30);
  growing.setInputCloud(cloud);
  growing.setInputNormals(normals);
  growing.setSmoothnessThreshold(angle * static_cast<float>(M_PI) / 180.0f);
  growing.setCurvatureThreshold(1.0f);
  std::vector<pcl::PointIndices> groups;
  growing.extract(groups);
  return numbered(groups, cloud->size());
}

Labels euclidean(const Cloud::Ptr& cloud, float apart, int smallest) {
  pcl::EuclideanClusterExtraction<Point> extraction;
  extraction.setClusterTolerance(apart);
  extraction.setMinClusterSize(smallest);
  extraction.setSearchMethod(std::make_shared<pcl::search::KdTree<Point>>());
  extraction.setInputCloud(cloud);
  std::vector<pcl::PointIndices> groups;
  extraction.extract(groups);
  return numbered(groups, cloud->size());
}

}  // namespace

std::string objects(const std::vector<std::string>& arguments) {
  if (arguments.size() != 6) throw std::invalid_argument("objects takes six arguments");
  const std::map<std::string, Labels (*)(const Cloud::Ptr&, float, int)> methods{
      {"lccp", lccp}, {"region_growing", region_growing}, {"clusters", euclidean}};
  const auto method = methods.at(arguments[0]);
  const auto numbers = read_numbers<float>(arguments[2]);
  auto cloud = std::make_shared<Cloud>(numbers.size() / 4, 1);
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    Point& point = (*cloud)[i];
    std::copy(&numbers[4 * i], &numbers[4 * i] + 3, point.data);
    std::memcpy(&point.rgba, &numbers[4 * i + 3], sizeof(point.rgba));
    point.a = 255;
  }
  cloud->is_dense = true;
  const int smallest = std::stoi(arguments[4]);

  const std::clock_t started = std::clock();
  const auto kept = off_plane(cloud, std::stof(arguments[3]));
  const auto rest = std::make_shared<Cloud>(*cloud, *kept);
  const Labels labels = method(rest, std::stof(arguments[1]), smallest);
  const double ms = 1e3 * static_cast<double>(std::clock() - started) / CLOCKS_PER_SEC;

  std::map<std::uint32_t, int> sizes;
  for (const auto label : labels) ++sizes[label];
  std::vector<std::int32_t> found(cloud->size(), 0);
  for (std::size_t row = 0; row < labels.size(); ++row)
    if (sizes[labels[row]] >= smallest) found[(*kept)[row]] = static_cast<std::int32_t>(labels[row]);
  write_numbers(arguments[5], found);
  return "\"objects\": {\"times_ms\": [" + std::to_string(ms) + "]}";
}
