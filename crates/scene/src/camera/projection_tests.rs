//! Against numbers that pycolmap 4.2.1 computed (`testdata/colmap/camera-models.json`).

use super::*;
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn cameras() -> Vec<(Camera, Value)> {
    let text = include_str!("../../../../testdata/colmap/camera-models.json");
    let fixture: Value = serde_json::from_str(text).unwrap();
    let rows = fixture["cameras"].as_array().unwrap().clone();
    let camera = |row: &Value| Camera {
        model: M::from_name(row["model"].as_str().unwrap()).unwrap(),
        width: row["width"].as_u64().unwrap() as usize,
        height: row["height"].as_u64().unwrap() as usize,
        params: numbers(&row["params"]),
    };
    rows.into_iter().map(|row| (camera(&row), row)).collect()
}

#[test]
fn every_model_agrees_with_pycolmap() {
    let cameras = cameras();
    assert_eq!(cameras.len(), 18);
    for (camera, row) in cameras {
        assert_eq!(row["id"].as_u64().unwrap() as u32, camera.model.id());
        let name = camera.model.name();
        let rays = row["rays"].as_array().unwrap();
        assert!(rays.len() >= 18);
        for pair in rays {
            let (p, r) = (numbers(&pair["pixel"]), numbers(&pair["ray"]));
            let (pixel, ray) = (DVec2::new(p[0], p[1]), DVec3::new(r[0], r[1], r[2]));
            let direction = camera.direction_from_pixel(pixel).unwrap();
            assert!((direction - ray).length() < 1e-8, "{name} {pixel}: {direction} is not {ray}");
            let back = camera.pixel_from_direction(ray * 3.0).unwrap();
            assert!((back - pixel).length() < 1e-5, "{name} {ray}: {back} is not {pixel}");
        }
        for pair in row["points"].as_array().unwrap() {
            let (p, q) = (numbers(&pair["point"]), numbers(&pair["pixel"]));
            let point = DVec3::new(p[0], p[1], p[2]);
            if let Some(pixel) = camera.pixel_from_direction(point) {
                assert!((pixel - DVec2::new(q[0], q[1])).length() < 1e-8, "{name} {point}");
            }
        }
    }
}

#[test]
fn pixels_survive_the_round_trip() {
    for (camera, _) in cameras() {
        let mut seen = 0;
        for i in 0..40 {
            for j in 0..30 {
                let pixel = DVec2::new(
                    (i as f64 + 0.5) / 40.0 * camera.width as f64,
                    (j as f64 + 0.5) / 30.0 * camera.height as f64,
                );
                let Some(direction) = camera.direction_from_pixel(pixel) else { continue };
                assert!((direction.length() - 1.0).abs() < 1e-12);
                let back = camera.pixel_from_direction(direction).unwrap_or(DVec2::NAN);
                let ok = (back - pixel).length() < 1e-6;
                assert!(ok, "{} {pixel} -> {direction} -> {back}", camera.model.name());
                seen += 1;
            }
        }
        assert!(
            seen > 1100,
            "{}: only {seen} of 1200 pixels have a direction",
            camera.model.name()
        );
    }
}

#[test]
fn a_fisheye_sees_behind_itself_and_a_pinhole_does_not() {
    let behind = DVec3::new(1.0, 0.0, -0.2);
    let fisheye = Camera {
        model: M::SimpleFisheye,
        width: 800,
        height: 800,
        params: vec![200.0, 400.0, 400.0],
    };
    let pixel = fisheye.pixel_from_direction(behind).unwrap();
    assert!((fisheye.direction_from_pixel(pixel).unwrap() - behind.normalize()).length() < 1e-12);
    let pinhole = Camera { model: M::SimplePinhole, ..fisheye };
    assert_eq!(pinhole.pixel_from_direction(behind), None);
    assert_eq!(pinhole.pixel_from_direction(DVec3::NAN), None);
}

#[test]
fn a_panorama_looks_forward_at_its_center() {
    let camera =
        Camera { model: M::Equirectangular, width: 400, height: 200, params: vec![400.0, 200.0] };
    let at = |d: DVec3| camera.pixel_from_direction(d).unwrap();
    assert_eq!(at(DVec3::Z), DVec2::new(200.0, 100.0));
    assert!((at(DVec3::X) - DVec2::new(300.0, 100.0)).length() < 1e-9, "right is +x");
    assert!(at(DVec3::new(0.0, -1.0, 0.1)).y < 20.0, "up is -y");
}
