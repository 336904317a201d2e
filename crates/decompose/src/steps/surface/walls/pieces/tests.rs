use glam::DVec3;
use motes_scene::UnitWorld;

use super::super::super::extract::tests::photos;
use super::*;

#[test]
fn pieces_have_every_pixel_once_and_none_is_too_large() {
    let view = View::new(&photos(1, 1.0, DVec3::ZERO)[0], &UnitWorld::IDENTITY);
    // Two bars, one across and one down.
    let is_in = |&k: &u32| {
        let [x, y] = view.at(k);
        (10..14).contains(&y) || (20..23).contains(&x)
    };
    let pixels: Vec<u32> = (0..view.luma.len() as u32).filter(is_in).collect();
    let mut parts = Vec::new();
    split(pixels.clone(), &view, 50, &mut parts);
    assert!(parts.iter().all(|p| (20..=50).contains(&p.len()) && p.is_sorted()));
    let mut all = parts.concat();
    all.sort_unstable();
    assert_eq!(all, pixels);
    let mut none = Vec::new();
    split(vec![7], &view, 0, &mut none);
    assert_eq!(none, [[7]]);
}
