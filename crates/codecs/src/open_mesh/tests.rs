use base64::Engine as _;
use motes_formats::images::encode_png;
use motes_scene::ImageU8;
use std::path::PathBuf;

use super::*;

/// Left half red, right half blue with half the alpha; green is 128 and blue of the right half 255.
fn picture() -> ImageU8 {
    let row = [[255, 0, 0, 255], [255, 0, 0, 255], [0, 0, 255, 64], [0, 0, 255, 64]];
    ImageU8::from_data(4, 4, 4, [row; 4].concat().concat())
}

fn base64(bytes: &[u8]) -> String {
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

/// A square of two triangles in the plane z = 0 with texture coordinates, and `extra` keys of the document.
fn square(material: &str, nodes: &str, image: &str) -> String {
    let mut bytes = Vec::new();
    let corners: [[f32; 3]; 4] =
        [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
    corners.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
    let uvs: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    uvs.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
    [0u16, 1, 2, 0, 2, 3].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":{nodes},
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"indices":2,"material":0}}]}}],
        "materials":[{material}],"textures":[{{"source":0,"sampler":0}}],"samplers":[{{"wrapS":33071,"wrapT":33071}}],
        "images":[{{"uri":"{image}"}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}},
        {{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":32}},
        {{"buffer":0,"byteOffset":80,"byteLength":12}}],
        "buffers":[{{"byteLength":{},"uri":"data:application/octet-stream;base64,{}"}}]}}"#,
        bytes.len(),
        base64(&bytes)
    )
}

const TEXTURED: &str = r#"{"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicRoughnessTexture":{"index":0},
    "roughnessFactor":0.5,"baseColorFactor":[1,1,0.5,1]}}"#;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, bytes).unwrap();
        path
    }

    fn open(&self, name: &str, text: &str) -> Result<Mesh> {
        Ok(open_mesh(&self.file(name, text))?.expect("a mesh"))
    }

    fn refusal(&self, name: &str, text: &str) -> String {
        self.open(name, text).expect_err(text).to_string()
    }
}

#[test]
fn textures_and_factors_of_gltf_reach_the_points() {
    let folder = Folder::new();
    folder.file("my picture.png", encode_png(&picture()));
    // A quarter turn about x, mirrored: +z of the mesh is then ... and its winding turns with it.
    let node = r#"[{"mesh":0,"scale":[-1,1,1],"translation":[0,0,5]}]"#;
    let text = square(TEXTURED, node, "my%20picture.png");
    let mesh = folder.open("square.gltf", &text).unwrap();
    assert!(mesh.surface.is_consistent());
    assert_eq!(mesh.up, DVec3::Y);
    // Flat, since none are given; a mirrored mesh keeps its outside.
    assert!(
        mesh.surface.normals.iter().all(|n| *n == [0.0, 0.0, 1.0]),
        "{:?}",
        mesh.surface.normals
    );
    assert_eq!(mesh.surface.vertices[0], [0.0, 0.0, 5.0]);
    let at = |x: f64| {
        // The point (x, small) of the first triangle (0, 0), (2, 0), (2, 2), mirrored: corners a, c, b.
        let y = 0.05;
        let (b, c) = ((x - y) / 2.0, y / 2.0);
        mesh.material_at(0, [1.0 - b - c, c, b], 0.01)
    };
    let left = at(0.5);
    assert_eq!(left.base_color_linear, [1.0, 0.0, 0.0]);
    assert_eq!((left.roughness, left.metallic, left.opacity), (0.0, 0.0, 1.0));
    let right = at(1.7);
    assert_eq!(right.base_color_linear, [0.0, 0.0, 0.5], "the factor is linear");
    assert_eq!((right.roughness, right.metallic), (0.0, 1.0));
    // Over a wide square both halves count, whatever its side.
    let wide = mesh.material_at(0, [0.4, 0.3, 0.3], 2.0).base_color_linear;
    assert!(wide[0] > 0.2 && wide[0] < 0.8 && wide[2] > 0.1 && wide[2] < 0.4, "{wide:?}");
    let baked = mesh.baked_surface();
    assert!(baked.base_color_linear[1][2] > 0.1, "{:?}", baked.base_color_linear);
}

#[test]
fn coverage_of_cut_outs_and_glass_is_kept() {
    let folder = Folder::new();
    folder.file("p.png", encode_png(&picture()));
    let with = |keys: &str| {
        let material =
            format!(r#"{{{keys},"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}"#);
        let mesh = folder.open("a.gltf", &square(&material, r#"[{"mesh":0}]"#, "p.png")).unwrap();
        [0.5, 1.7].map(|x| mesh.material_at(0, [1.0 - x / 2.0, x / 2.0 - 0.02, 0.02], 0.01).opacity)
    };
    assert_eq!(with(r#""alphaMode":"MASK""#), [1.0, 0.0]);
    assert_eq!(with(r#""alphaMode":"OPAQUE""#), [1.0, 1.0]);
    let glass = with(r#""alphaMode":"BLEND""#);
    assert!((glass[1] - 64.0 / 255.0).abs() < 1e-4 && glass[0] > 0.999, "{glass:?}");
}

#[test]
fn documents_reach_nowhere_else() {
    let folder = Folder::new();
    folder.file("in/p.png", encode_png(&picture()));
    for (image, says) in [
        ("../p.png", "leads out of the folder"),
        ("%2e%2e/p.png", "leads out of the folder"),
        ("/etc/passwd", "is absolute"),
        ("file:///etc/passwd", "nothing is fetched"),
        ("https://example.org/p.png", "nothing is fetched"),
        ("data:image/png;base64,AAAA", "not an image"),
    ] {
        let error = folder.refusal("in/a.gltf", &square(TEXTURED, r#"[{"mesh":0}]"#, image));
        assert!(error.contains(says), "{image}: {error}");
    }
    for (line, says) in [
        ("mtllib ../a.mtl", "leads out of the folder"),
        ("mtllib /etc/passwd", "is absolute"),
        ("mtllib gone.mtl", "gone.mtl"),
        ("mtllib bad.mtl", "leads out of the folder"),
    ] {
        folder.file("in/bad.mtl", "newmtl a\nmap_Kd ../../p.png\n");
        let error = folder.refusal("in/a.obj", &format!("{line}\nv 0 0 0\n"));
        assert!(error.contains(says), "{line}: {error}");
    }
}

#[test]
fn broken_and_explosive_gltf_is_refused() {
    let folder = Folder::new();
    folder.file("p.png", encode_png(&picture()));
    let good = square(TEXTURED, r#"[{"mesh":0}]"#, "p.png");
    assert!(folder.open("a.gltf", &good).is_ok());
    let many = format!("[{}]", vec![r#"{"mesh":0}"#; 400_000].join(","));
    let roots = (0..400_000).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
    let many = square(TEXTURED, &many, "p.png")
        .replace(r#"{"nodes":[0]}"#, &format!(r#"{{"nodes":[{roots}]}}"#));
    for (text, says) in [
        (square(TEXTURED, r#"[{"children":[1,1]},{"mesh":0}]"#, "p.png"), "do not form a tree"),
        (square(TEXTURED, r#"[{"mesh":7}]"#, "p.png"), "no mesh 7"),
        (good.replace(r#""count":6"#, r#""count":600000000"#), "do not fit"),
        (good.replace(r#""indices":2"#, r#""indices":0"#), "instead of SCALAR"),
        (good.replace(r#""material":0"#, r#""material":3"#), "materials[3]"),
        (good.replace(r#""source":0"#, r#""source":9"#), "textures[0]"),
        (good.replace(r#""indices":2"#, r#""mode":1,"indices":2"#), "no triangles"),
        (
            good.replace(
                r#""scene":0"#,
                r#""scene":0,"extensionsRequired":["KHR_draco_mesh_compression"]"#,
            ),
            "KHR_draco",
        ),
        ("{".into(), "not a glTF document"),
    ] {
        let error = folder.refusal("a.gltf", &text);
        assert!(error.contains(says), "{says}: {error}");
    }
    // 400,000 places of one square: as many rows as the file has bytes for, or a refusal, but no hour.
    let opened = folder.open("a.gltf", &many);
    assert!(opened.is_ok_and(|mesh| mesh.surface.triangles.len() == 800_000));
}

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf -4 -5 -8 -4\n";

#[test]
fn a_cube_keeps_its_flat_faces_and_a_ball_is_smooth() {
    let folder = Folder::new();
    let cube = CUBE.replace("f -4 -5 -8 -4", "f -5 -8 -4 -1");
    let mesh = folder.open("cube.obj", &cube).unwrap();
    assert_eq!((mesh.surface.vertices.len(), mesh.surface.triangles.len()), (24, 12));
    for triangle in &mesh.surface.triangles {
        let axes = triangle.map(|v| mesh.surface.normals[v as usize]);
        assert!(axes[0].iter().filter(|x| x.abs() > 0.999).count() == 1, "{axes:?}");
        assert!(axes.iter().all(|n| *n == axes[0]));
    }
    // A prism of 24 sides: neighbors differ by 15 degrees, the lids by 90.
    let mut prism = String::new();
    for k in 0..24 {
        let a = f64::from(k) * std::f64::consts::TAU / 24.0;
        prism.push_str(&format!("v {} {} 0\nv {} {} 1\n", a.cos(), a.sin(), a.cos(), a.sin()));
    }
    for k in 0..24 {
        let (i, j) = (2 * k + 1, 2 * ((k + 1) % 24) + 1);
        prism.push_str(&format!("f {i} {j} {} {}\n", j + 1, i + 1));
    }
    let smooth = folder.open("prism.obj", &prism).unwrap();
    assert_eq!(smooth.surface.vertices.len(), 48, "no vertex is doubled");
    let flat = folder.open("prism.obj", &format!("s off\n{prism}")).unwrap();
    assert_eq!(flat.surface.vertices.len(), 96, "the file says flat");
}

#[test]
fn materials_of_obj_reach_the_points() {
    let folder = Folder::new();
    folder.file("maps/p.png", encode_png(&picture()));
    let library = "newmtl brass\nKd 0.6 0.4 0.1\nPr 0.25\nPm 1\n\
        newmtl wall\nKd 0 0 0\nNs 0\nmap_Kd -clamp on maps\\p.png\n";
    folder.file("a.mtl", library);
    let text = "mtllib a.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 1\n\
        usemtl brass\nf 1 2 3\nusemtl wall\nf 1/1 2/2 3/3\nusemtl nothing\nf 1 3 4\n";
    let mesh = folder.open("a.obj", text).unwrap();
    let brass = mesh.material_at(0, [0.3, 0.3, 0.4], 0.1);
    assert_eq!(
        (brass.base_color_linear, brass.roughness, brass.metallic),
        ([0.6, 0.4, 0.1], 0.25, 1.0)
    );
    let wall = mesh.material_at(1, [0.85, 0.1, 0.05], 0.01);
    assert_eq!((wall.base_color_linear, wall.roughness), ([1.0, 0.0, 0.0], 1.0));
    assert_eq!(mesh.material_at(2, [0.3, 0.3, 0.4], 0.1).base_color_linear, GRAY);
}

#[test]
fn mistakes_of_obj_are_named_by_their_line() {
    let folder = Folder::new();
    folder.file("short.mtl", "newmtl a\nKd 0.5\n");
    folder.file("none.mtl", "newmtl a\nKd\n");
    let good =
        folder.open("a.obj", "mtllib short.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
    assert_eq!(good.unwrap().material_at(0, [0.2, 0.2, 0.6], 0.1).base_color_linear, [0.5; 3]);
    for (text, says) in [
        ("v 0 0\n", "line 1"),
        ("v 0 0 nan\n", "line 1"),
        ("v 0 0 1e99\n", "line 1"),
        ("v 0 0 0\nv 1 0 0\nf 1 2 3\n", "names a vertex of 2"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "names a vertex of 3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "line 4"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9223372036854775808\n", "line 4"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/9 2 3\n", "texture coordinate of 0"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//x 2 3\n", "not the number of a normal"),
        ("v 0 0 0\n", "no faces"),
        ("mtllib none.mtl\n", "Kd has no numbers"),
        ("", "no faces"),
    ] {
        let error = folder.refusal("a.obj", text);
        assert!(error.contains(says), "{text:?}: {error}");
    }
}

#[test]
fn other_files_are_no_meshes() {
    let folder = Folder::new();
    for (name, text) in [
        ("a.txt", "v 0 0 0"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n"),
        ("a.fbx", ""),
    ] {
        assert!(open_mesh(&folder.file(name, text)).unwrap().is_none(), "{name}");
    }
    assert!(open_mesh(&folder.0.path().join("gone.obj")).unwrap().is_none());
}
