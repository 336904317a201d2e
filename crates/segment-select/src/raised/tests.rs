use super::*;

const CAMERAS: [DVec3; 1] = [DVec3::new(0.0, 0.0, 5.0)];

/// A square grid of superpixels that face up, of side 0.1, around the axis.
fn square(half: i32, height: f32) -> Vec<Segment> {
    let at = |k: i32| k as f32 * 0.1;
    let of = |x: i32, y: i32| Segment {
        area_px: 80.0,
        point: [at(x), at(y), height],
        normal: [0.0, 0.0, 1.0],
        width: 0.1,
        ..Segment::default()
    };
    (-half..=half).flat_map(|x| (-half..=half).map(move |y| of(x, y))).collect()
}

fn find(scene: &[Segment]) -> Vec<RaisedSupport> {
    let segments: Vec<&Segment> = scene.iter().collect();
    let floor = SupportPlane::find(&segments, &CAMERAS).expect("a floor");
    assert!(floor.offset.abs() < 0.01, "{floor:?}");
    RaisedSupport::find(&segments, &floor)
}

fn at(x: f32, height: f32) -> Segment {
    let normal = [0.0, 0.0, 1.0];
    Segment { area_px: 80.0, point: [x, 0.0, height], normal, width: 0.1, ..Segment::default() }
}

#[test]
fn a_table_carries_what_is_above_it_and_not_its_legs() {
    let scene = [square(20, 0.0), square(10, 1.0)].concat();
    let found = find(&scene);
    let [table] = &found[..] else { panic!("{found:?}") };
    assert!((table.plane.offset - 1.0).abs() < 0.01 && table.plane.normal.z > 0.99, "{table:?}");
    assert!(table.carries(&at(0.0, 1.5)));
    assert!(!table.carries(&at(0.0, 1.0)) && table.holds(&at(0.0, 1.0)));
    let side = Segment { normal: [1.0, 0.0, 0.0], ..at(0.0, 1.0) };
    assert!(table.holds_foot(&side) && !table.holds_foot(&at(0.0, 1.0)));
    for beside in [at(0.6, 0.5), at(1.4, 1.5)] {
        assert!(!table.carries(&beside) && !table.holds(&beside), "{beside:?}");
    }
    assert!(table.is_near(&at(0.0, 1.1), 2.0) && !table.is_near(&at(0.0, 1.6), 2.0));
}

#[test]
fn a_small_top_is_no_support_and_two_shelves_are_two() {
    assert!(find(&[square(20, 0.0), square(5, 1.0)].concat()).is_empty());
    let two = find(&[square(20, 0.0), square(12, 1.0), square(10, 2.0)].concat());
    assert_eq!(two.len(), 2);
    assert!((two[0].plane.offset - 1.0).abs() < 0.01 && (two[1].plane.offset - 2.0).abs() < 0.01);
}

#[test]
fn tops_of_several_boxes_are_no_table() {
    let boxes = [[-1.5, -1.5], [1.5, -1.5], [-1.5, 1.5], [1.5, 1.5]].map(|[x, y]| {
        let mut top = square(4, 0.5);
        top.iter_mut().for_each(|s| s.point = [s.point[0] + x, s.point[1] + y, s.point[2]]);
        top
    });
    assert!(find(&[square(20, 0.0), boxes.concat()].concat()).is_empty());
}
