//! Small COLMAP projects made on the spot: cameras on a ring look at the origin and photograph a
//! pattern that depends on the viewing direction only, so that every pixel of every lens has a
//! known color.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};
use import_colmap::{
    ImportInput, ImportOptions, ImportReport, IngestError, Result, SfmOptions, Silent, Source,
    import,
};
use motes_formats::capture::read_capture;
use motes_formats::images::write_png;
use motes_scene::{Camera, CameraModel, Capture, ImageU8, Pose, Split, Switch};

pub(crate) struct Project {
    pub(crate) folder: tempfile::TempDir,
    pub(crate) cameras: Vec<Camera>,
    /// Name, index of the camera, pose.
    pub(crate) images: Vec<(String, usize, Pose)>,
    pub(crate) points: Vec<DVec3>,
}

/// Smooth, without symmetry, 0 to 255 per channel, of a direction in the camera frame.
pub(crate) fn pattern(d: DVec3) -> [f64; 3] {
    let (x, y) = (d.x / d.z, d.y / d.z);
    let wave = |a: f64, b: f64, c: f64| 127.5 + 100.0 * (a * x + b * y + c).sin();
    [wave(9.0, 3.0, 0.2), wave(-4.0, 8.0, 1.0), wave(5.0, 5.0, 2.0)]
}

/// What the camera sees of the pattern; black where no direction leads to the pixel.
pub(crate) fn photograph(camera: &Camera) -> ImageU8 {
    let mut image = ImageU8::filled(camera.width, camera.height, 3, 0);
    for y in 0..camera.height {
        for x in 0..camera.width {
            let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            if let Some(d) = camera.direction_from_pixel(pixel).filter(|d| d.z > 0.0) {
                image.pixel_mut(x, y).copy_from_slice(&pattern(d).map(|v| v.round() as u8));
            }
        }
    }
    image
}

pub(crate) fn ring_pose(index: usize, count: usize, center: DVec3) -> Pose {
    let angle = std::f64::consts::TAU * index as f64 / count as f64;
    let eye = center + DVec3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 1.0);
    Pose::look_at(eye, center, DVec3::Z).unwrap()
}

impl Project {
    pub(crate) fn new(camera: Camera, names: &[&str]) -> Self {
        Self::around(camera, names, DVec3::ZERO)
    }

    pub(crate) fn around(camera: Camera, names: &[&str], center: DVec3) -> Self {
        let place =
            |(i, name): (usize, &&str)| (name.to_string(), 0, ring_pose(i, names.len(), center));
        let images = names.iter().enumerate().map(place).collect();
        let offsets = [(0.1, 0.2, 0.0), (-0.2, 0.1, 0.1), (0.0, -0.1, 0.3), (0.2, -0.2, 0.2)];
        let points = offsets.iter().map(|&(x, y, z)| center + DVec3::new(x, y, z)).collect();
        let folder = tempfile::tempdir().unwrap();
        Self { folder, cameras: vec![camera], images, points }
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn output(&self) -> PathBuf {
        self.path().join("out")
    }

    /// Writes the photos to `images/`.
    pub(crate) fn write_photos(&self) {
        let photos: Vec<ImageU8> = self.cameras.iter().map(photograph).collect();
        for (name, camera, _) in &self.images {
            let path = self.path().join("images").join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            write_png(&path, &photos[*camera]).unwrap();
        }
    }

    /// Writes the model as text to `sparse/0`: every photo sees every point.
    pub(crate) fn write_model(&self) {
        self.write_model_to("sparse/0");
    }

    pub(crate) fn write_model_to(&self, place: &str) {
        let folder = self.path().join(place);
        std::fs::create_dir_all(&folder).unwrap();
        let mut cameras = String::new();
        for (i, c) in self.cameras.iter().enumerate() {
            let params: Vec<String> = c.params.iter().map(f64::to_string).collect();
            let name = c.model.name();
            writeln!(cameras, "{} {name} {} {} {}", i + 1, c.width, c.height, params.join(" "))
                .unwrap();
        }
        let mut images = String::new();
        for (i, (name, camera, pose)) in self.images.iter().enumerate() {
            let (q, t) = (pose.rotation, pose.translation);
            writeln!(
                images,
                "{} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {} {name}",
                i + 1,
                q.w,
                q.x,
                q.y,
                q.z,
                t.x,
                t.y,
                t.z,
                camera + 1
            )
            .unwrap();
            for (id, point) in self.points.iter().enumerate() {
                let pixel = self.cameras[*camera]
                    .pixel_from_direction(pose.transform_point(*point))
                    .unwrap_or(DVec2::ZERO);
                write!(images, "{:?} {:?} {} ", pixel.x, pixel.y, id + 1).unwrap();
            }
            images.push('\n');
        }
        let mut points = String::new();
        for (id, p) in self.points.iter().enumerate() {
            let track: Vec<String> =
                (1..=self.images.len()).map(|image| format!("{image} {id}")).collect();
            let color = 10 * id % 256;
            writeln!(
                points,
                "{} {:?} {:?} {:?} {color} 0 0 0.5 {}",
                id + 1,
                p.x,
                p.y,
                p.z,
                track.join(" ")
            )
            .unwrap();
        }
        std::fs::write(folder.join("cameras.txt"), cameras).unwrap();
        std::fs::write(folder.join("images.txt"), images).unwrap();
        std::fs::write(folder.join("points3D.txt"), points).unwrap();
    }

    /// Writes model and photos and imports them.
    pub(crate) fn import(&self, options: &ImportOptions) -> Result<ImportReport> {
        self.write_photos();
        self.write_model();
        self.import_written(options)
    }

    pub(crate) fn import_written(&self, options: &ImportOptions) -> Result<ImportReport> {
        import_path(self.path(), &self.output(), options)
    }
}

pub(crate) fn import_path(
    input: &Path,
    output: &Path,
    options: &ImportOptions,
) -> Result<ImportReport> {
    std::fs::create_dir_all(output).unwrap();
    let input = ImportInput { input: Some(input.to_path_buf()), ..ImportInput::default() };
    // Without pycolmap, whether this machine has it or not.
    let sfm = SfmOptions { triangulate: Switch::Off, ..SfmOptions::default() };
    import(&Source::recognize(&input)?, output, options, &sfm, &Silent)
}

pub(crate) const NAMES: [&str; 10] = [
    "p0.png", "p1.png", "p2.png", "p3.png", "p4.png", "p5.png", "p6.png", "p7.png", "p8.png",
    "p9.png",
];

pub(crate) fn pinhole() -> Camera {
    Camera {
        model: CameraModel::Pinhole,
        width: 64,
        height: 48,
        params: vec![60.0, 60.0, 32.0, 24.0],
    }
}

pub(crate) fn capture_of(project: &Project) -> Capture {
    read_capture(&project.output().join("capture.json")).unwrap()
}

pub(crate) fn names_of(capture: &Capture, split: Split) -> Vec<&str> {
    capture.views_of(split).into_iter().map(|i| capture.views[i].name.as_str()).collect()
}

pub(crate) fn bad_input(error: IngestError) -> (String, String) {
    match error {
        IngestError::BadInput { cause, remedy } => (cause, remedy),
        other => panic!("not bad input: {other:?}"),
    }
}
