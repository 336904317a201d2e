use super::*;

/// Gaussians on a grid of a box with this corner, five a side and a tenth apart.
fn block(corner: [f32; 3]) -> Vec<[f32; 3]> {
    let at = |i: usize| [i % 5, i / 5 % 5, i / 25].map(|v| v as f32 * 0.1);
    (0..125).map(|i| std::array::from_fn(|c| corner[c] + at(i)[c])).collect()
}

fn gaussians(blocks: &[Vec<[f32; 3]>]) -> Gaussians {
    let means = blocks.concat();
    let log_scales = vec![[-4.0; 3]; means.len()];
    Gaussians { means, log_scales, ..Gaussians::empty(0) }
}

/// How many of each block are left, all selected before.
fn left(blocks: &[Vec<[f32; 3]>], clicked: &[Vec3]) -> Vec<usize> {
    let gaussians = gaussians(blocks);
    let all = Selection { confidence: vec![1.0; gaussians.means.len()] };
    let kept = without_islands(&gaussians, &all, clicked);
    let mut from = 0;
    let count = |block: &Vec<[f32; 3]>| {
        from += block.len();
        (from - block.len()..from).filter(|&i| kept.contains(i)).count()
    };
    blocks.iter().map(count).collect()
}

#[test]
fn what_is_far_from_a_thing_is_left_out() {
    let thing = block([0.0; 3]);
    let far: Vec<[f32; 3]> = block([9.0, 0.0, 0.0])[..40].to_vec();
    assert_eq!(left(&[thing.clone(), far.clone()], &[]), [125, 0]);
    assert_eq!(left(&[far, thing], &[Vec3::splat(0.2)]), [0, 125]);
}

#[test]
fn parts_of_a_thing_on_both_sides_of_what_hides_its_middle_stay() {
    // Two blocks of one thing, with something before the middle of it.
    let (a, mut b) = (block([0.0; 3]), block([1.0, 0.0, 0.0]));
    b.truncate(60);
    assert_eq!(left(&[a, b], &[]), [125, 60]);
}

#[test]
fn what_a_click_points_at_stays_however_far_it_is() {
    let (a, b, c) = (block([0.0; 3]), block([9.0, 0.0, 0.0]), block([0.0, 30.0, 0.0]));
    let blocks = [a, b[..30].to_vec(), c[..30].to_vec()];
    assert_eq!(left(&blocks, &[Vec3::ZERO, Vec3::new(9.0, 0.1, 0.1)]), [125, 30, 0]);
}

#[test]
fn large_gaussians_of_a_bare_part_belong_to_the_thing() {
    let thing = block([0.0; 3]);
    let mut scene = gaussians(&[thing, vec![[2.0, 0.2, 0.2], [3.2, 0.2, 0.2]]]);
    let all = Selection { confidence: vec![1.0; 127] };
    assert_eq!(without_islands(&scene, &all, &[]).count(), 125);
    scene.log_scales[125..].fill([-0.7, -0.7, -4.0]);
    assert_eq!(without_islands(&scene, &all, &[]).count(), 127);
}

#[test]
fn nothing_and_one_gaussian_and_broken_ones_stay_as_they_are() {
    assert_eq!(left(&[], &[Vec3::ZERO]), [0usize; 0]);
    assert_eq!(left(&[vec![[1.0; 3]]], &[]), [1]);
    let broken = vec![[f32::NAN; 3], [f32::INFINITY, 0.0, 0.0]];
    assert_eq!(left(&[block([0.0; 3]), broken], &[Vec3::NAN]), [125, 2]);
    assert_eq!(left(&[vec![[1.0; 3]; 200]], &[]), [200]);
}
