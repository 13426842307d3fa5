// Fits a cylinder to oriented points with PCL's RANSAC, as the paper does; the peer of bench_fitting.py.
//
// stdin:  binary little-endian, for each case: int32 n, double distance threshold, n × 6 doubles (point, normal)
// stdout: a line a case: found (0/1), seconds (best of three), point x y z, axis x y z, radius
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_cylinder.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <vector>

int main() {
    std::int32_t count = 0;
    while (std::fread(&count, sizeof count, 1, stdin) == 1) {
        double threshold = 0.0;
        std::vector<double> rows(6 * static_cast<std::size_t>(count));
        if (std::fread(&threshold, sizeof threshold, 1, stdin) != 1 ||
            std::fread(rows.data(), sizeof(double), rows.size(), stdin) != rows.size()) {
            return 1;
        }
        auto points = pcl::PointCloud<pcl::PointXYZ>::Ptr(new pcl::PointCloud<pcl::PointXYZ>);
        auto normals = pcl::PointCloud<pcl::Normal>::Ptr(new pcl::PointCloud<pcl::Normal>);
        for (std::int32_t i = 0; i < count; ++i) {
            const double* row = &rows[6 * static_cast<std::size_t>(i)];
            points->push_back(pcl::PointXYZ(row[0], row[1], row[2]));
            normals->push_back(pcl::Normal(row[3], row[4], row[5]));
        }
        bool found = false;
        double best = 1e300;
        Eigen::VectorXf rough = Eigen::VectorXf::Zero(7), fine = Eigen::VectorXf::Zero(7);
        for (int repeat = 0; repeat < 3; ++repeat) {
            const auto start = std::chrono::steady_clock::now();
            auto model = pcl::SampleConsensusModelCylinder<pcl::PointXYZ, pcl::Normal>::Ptr(
                new pcl::SampleConsensusModelCylinder<pcl::PointXYZ, pcl::Normal>(points));
            model->setInputNormals(normals);
            model->setNormalDistanceWeight(0.1);
            pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, threshold);
            ransac.setMaxIterations(10000);
            found = ransac.computeModel();
            if (found) {
                std::vector<int> inliers;
                ransac.getInliers(inliers);
                ransac.getModelCoefficients(rough);
                model->optimizeModelCoefficients(inliers, rough, fine);
            }
            const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
            best = std::min(best, took.count());
        }
        std::printf("%d %.9g", found ? 1 : 0, best);
        for (int k = 0; k < 7; ++k) {
            std::printf(" %.9g", fine[k]);
        }
        std::printf("\n");
    }
    return 0;
}
