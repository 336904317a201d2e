//! The files of a ground-truth folder; `docs/formats/ground-truth.md` describes them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use glam::{DMat3, DVec3};
use motes_formats::atomic::write_atomic;
use motes_formats::exr_aov::{AovChannel, write_exr};
use motes_formats::images::write_png;
use motes_scene::{ImageF32, ImageU8};
use serde_json::{Value, json};

use crate::MakeOptions;
use crate::cameras::Shot;
use crate::lights::horizontal_irradiance;
use crate::photography::Camera;
use crate::photos::Photos;
use crate::points::SparsePoint;
use crate::render::Buffers;
use crate::scenes::SceneRecipe;
use crate::world::World;

/// A folder that is being written.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
    exposure: f64,
    camera: Camera,
    is_masked: bool,
}

fn half_rgb(image: &ImageF32) -> Vec<AovChannel> {
    let plane = |c: usize| -> Vec<f32> {
        let c = c.min(image.channels - 1);
        image.data.iter().skip(c).step_by(image.channels).copied().collect()
    };
    ["R", "G", "B"].iter().enumerate().map(|(c, n)| AovChannel::half(*n, &plane(c))).collect()
}

impl Folder {
    /// Makes the folders; `exposure` is linear photo value over radiance.
    ///
    /// # Errors
    /// When one cannot be made.
    pub fn create(root: &Path, exposure: f64) -> anyhow::Result<Self> {
        for part in ["images", "sparse/0", "sparse_test/0", "aov", "env"] {
            let path = root.join(part);
            std::fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
        }
        Ok(Self { root: root.to_path_buf(), exposure, camera: Camera::default(), is_masked: false })
    }

    /// Pictures are developed as this camera does; [`Self::light`]'s previews, too.
    pub fn taken_with(self, camera: Camera) -> Self {
        Self { camera, ..self }
    }

    /// Pictures have an alpha channel: what they show of the scene.
    pub fn with_masks(self, is_masked: bool) -> Self {
        Self { is_masked, ..self }
    }

    /// A picture with its mask, where the scene wants one.
    pub fn masked(&self, image: ImageU8, buffers: &Buffers) -> ImageU8 {
        if !self.is_masked {
            return image;
        }
        let alpha = buffers.coverage.data.iter().map(|c| (255.0 * c.min(1.0)).round() as u8);
        let pixels = image.data.chunks_exact(3).zip(alpha);
        let data = pixels.flat_map(|(rgb, alpha)| [rgb[0], rgb[1], rgb[2], alpha]).collect();
        ImageU8::from_data(image.width, image.height, 4, data)
    }

    fn exr(&self, name: &str, image: &ImageF32, channels: &[AovChannel]) -> anyhow::Result<()> {
        let path = self.root.join(name);
        Ok(write_exr(&path, image.width, image.height, channels, &[])?)
    }

    fn text(&self, name: &str, text: &str) -> anyhow::Result<()> {
        let path = self.root.join(name);
        write_atomic(&path, |w| w.write_all(text.as_bytes())).map_err(Into::into)
    }

    /// A light's map, f32, Blender's axes.
    ///
    /// # Errors
    /// When it cannot be written, as all of these.
    pub fn light(&self, name: &str, picture: &ImageF32) -> anyhow::Result<()> {
        let plane = |c: usize| picture.data.iter().skip(c).step_by(3).copied().collect();
        let channels: Vec<AovChannel> = ["R", "G", "B"]
            .iter()
            .enumerate()
            .map(|(c, n)| AovChannel::float(*n, plane(c)))
            .collect();
        self.exr(&format!("env/{name}.exr"), picture, &channels)?;
        self.photo(&format!("env/{name}_preview.png"), picture)
    }

    /// Radiance as a picture without noise and drift.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn photo(&self, name: &str, radiance: &ImageF32) -> anyhow::Result<()> {
        self.png(name, &self.developed(radiance))
    }

    fn developed(&self, radiance: &ImageF32) -> ImageU8 {
        self.camera.developed(&radiance.clone().scaled(self.exposure as f32))
    }

    /// A picture as it is.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn png(&self, name: &str, image: &ImageU8) -> anyhow::Result<()> {
        Ok(write_png(&self.root.join(name), image)?)
    }

    /// Radiance of the test views, as photos with masks where the scene has them and as EXR without exposure.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn frames(
        &self,
        folder: &str,
        shots: &[Shot],
        frames: &[ImageF32],
        buffers: &[Buffers],
    ) -> anyhow::Result<()> {
        std::fs::create_dir_all(self.root.join(folder))?;
        for ((shot, frame), buffers) in shots.iter().zip(frames).zip(buffers) {
            let picture = self.masked(self.developed(frame), buffers);
            self.png(&format!("{folder}/{}.png", shot.name), &picture)?;
            self.exr(&format!("{folder}/{}.exr", shot.name), frame, &half_rgb(frame))?;
        }
        Ok(())
    }

    /// The buffers of a view.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn buffers(&self, shot: &Shot, b: &Buffers) -> anyhow::Result<()> {
        for (what, image) in [
            ("albedo", &b.albedo),
            ("roughness", &b.roughness),
            ("metallic", &b.metallic),
            ("normal", &b.normal),
        ] {
            self.exr(&format!("aov/{}_{what}.exr", shot.name), image, &half_rgb(image))?;
        }
        let depth = [AovChannel::float("Z", b.depth.data.clone())];
        self.exr(&format!("aov/{}_depth.exr", shot.name), &b.depth, &depth)
    }

    /// Object ids of a view, as gray values.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn ids(&self, shot: &Shot, b: &Buffers) -> anyhow::Result<()> {
        self.ids_as(&format!("aov/{}_id.png", shot.name), b)
    }

    /// Object ids as gray values, by name.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn ids_as(&self, name: &str, b: &Buffers) -> anyhow::Result<()> {
        let image = ImageU8::from_data(b.depth.width, b.depth.height, 1, b.ids.clone());
        Ok(write_png(&self.root.join(name), &image)?)
    }

    /// The models of the train and of the test views, as text.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn colmap(&self, all: &Photos, points: &[SparsePoint]) -> anyhow::Result<()> {
        let Some(first) = all.shots.first() else { return Ok(()) };
        let ((w, h), f) = (first.size, first.focal);
        let (cx, cy) = (w as f64 / 2.0, h as f64 / 2.0);
        let cameras = format!(
            "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n1 PINHOLE {w} {h} {f} {f} {cx} {cy}\n"
        );
        let mut keypoints = vec![Vec::new(); all.train];
        let mut text =
            String::from("# POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID POINT2D_IDX)\n");
        for (id, point) in (1..).zip(points) {
            let (p, [r, g, b]) = (point.position, point.color);
            write!(text, "{id} {} {} {} {r} {g} {b} {:.4}", p.x, p.y, p.z, point.error)?;
            for (view, at) in &point.track {
                write!(text, " {} {}", view + 1, keypoints[*view].len())?;
                keypoints[*view].push((*at, id));
            }
            text.push('\n');
        }
        for folder in ["sparse/0", "sparse_test/0"] {
            self.text(&format!("{folder}/cameras.txt"), &cameras)?;
        }
        self.text("sparse/0/points3D.txt", &text)?;
        self.text("sparse_test/0/points3D.txt", "# none\n")?;
        let images = |shots: &[Shot], first_id: usize| {
            let mut text =
                String::from("# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then POINTS2D[]\n");
            for (i, shot) in shots.iter().enumerate() {
                let (q, t) = (shot.camera_from_world.rotation, shot.camera_from_world.translation);
                let id = i + first_id;
                let pose = format!("{} {} {} {} {} {} {}", q.w, q.x, q.y, q.z, t.x, t.y, t.z);
                writeln!(text, "{id} {pose} 1 {}.png", shot.name)?;
                let seen = if first_id == 1 { keypoints[i].as_slice() } else { &[] };
                let words: Vec<String> =
                    seen.iter().map(|(at, id)| format!("{:.2} {:.2} {id}", at[0], at[1])).collect();
                writeln!(text, "{}", words.join(" "))?;
            }
            anyhow::Ok(text)
        };
        self.text("sparse/0/images.txt", &images(&all.shots[..all.train], 1)?)?;
        self.text("sparse_test/0/images.txt", &images(&all.shots[all.train..], 1001)?)
    }

    /// `transforms_*.json`, `scene.json` and a note for people.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn documents(
        &self,
        recipe: &SceneRecipe,
        world: &World,
        all: &Photos,
        lights: &[(&str, ImageF32)],
        options: &MakeOptions,
    ) -> anyhow::Result<()> {
        let Some(first) = all.shots.first() else { return Ok(()) };
        let (w, h) = first.size;
        let (train, test) = all.shots.split_at(all.train);
        for (name, shots, folder) in [("train", train, "images"), ("test", test, "test/capture")] {
            let frames: Vec<Value> = shots.iter().map(|s| frame(s, folder)).collect();
            let document = json!({
                "camera_model": "PINHOLE", "w": w, "h": h, "cx": w as f64 / 2.0, "cy": h as f64 / 2.0,
                "fl_x": first.focal, "fl_y": first.focal,
                "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0, "frames": frames,
            });
            self.text(
                &format!("transforms_{name}.json"),
                &serde_json::to_string_pretty(&document)?,
            )?;
        }
        let of_light = |(name, picture): &(&str, ImageF32)| {
            let irradiance = horizontal_irradiance(picture).to_array();
            let file = format!("env/{name}.exr");
            ((*name).to_owned(), json!({"file": file, "horizontal_irradiance_rgb": irradiance}))
        };
        let lamp = crate::world::shade();
        let ground = std::iter::once(("ground", &recipe.ground));
        let things = recipe.things.iter().map(|t| (t.name, &t.paint));
        let named = ground.chain(things).chain(recipe.lamps.iter().map(|l| (l.name, &lamp)));
        let objects: Vec<Value> = (1..)
            .zip(named)
            .zip(&world.bounds)
            .skip(usize::from(!recipe.has_ground))
            .map(|((id, (name, paint)), (low, high))| {
                let lambert = recipe.lambert;
                json!({
                    "id": id, "name": name, "metallic": paint.metallic,
                    "roughness": if lambert { 1.0 } else { paint.roughness },
                    "bbox_min": low.to_array(), "bbox_max": high.to_array(),
                })
            })
            .collect();
        let relights: Vec<&str> = recipe.relights.iter().map(|(name, _)| *name).collect();
        let bsdf = if recipe.lambert {
            "lambert".into()
        } else {
            format!("{:?}", options.lobes).to_lowercase()
        };
        let scene = json!({
            "title": recipe.name, "width": w, "height": h, "fl": first.focal,
            "cx": w as f64 / 2.0, "cy": h as f64 / 2.0, "exposure": self.exposure,
            "capture_light": recipe.capture_light.0, "relight_lights": relights, "bsdf": bsdf,
            "objects": objects, "lights": lights.iter().map(of_light).collect::<serde_json::Map<_, _>>(),
            "lamps": recipe.lamps.iter().map(|l| l.name).collect::<Vec<_>>(), "faults": self.camera.faults,
            "masked": recipe.is_masked, "samples": options.samples, "bounces": options.bounces, "seed": options.seed,
        });
        self.text("scene.json", &serde_json::to_string_pretty(&scene)?)?;
        let note = format!(
            "# {}\n\nMade by `truth-scene`. Light {}; exposure {}: linear photo value = radiance x exposure.\n\
             Maps in Blender's axes (z up, center +x). BRDF: {bsdf}. One unit of the scene is {} world units.\n",
            recipe.name, recipe.capture_light.0, self.exposure, recipe.unit
        );
        self.text("README.md", &note)
    }
}

fn frame(shot: &Shot, folder: &str) -> Value {
    let world = shot.camera_from_world.inverse();
    // Camera axes x right, y up, z backward.
    let axes = world.rotation_matrix() * DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let mut rows: Vec<Vec<f64>> = (0..3)
        .map(|r| axes.row(r).to_array().into_iter().chain([world.translation[r]]).collect())
        .collect();
    rows.push(vec![0.0, 0.0, 0.0, 1.0]);
    json!({"file_path": format!("{folder}/{}.png", shot.name), "transform_matrix": rows})
}
