use super::*;
use crate::documents::parse_document;

fn bound(count: usize) -> BoundGaussians {
    BoundGaussians {
        sha256: "a".repeat(64),
        count: count as u64,
        name: "g.ply".into(),
        same_rows_as: None,
    }
}

fn sample() -> Selection {
    let confidence = (0..21).map(|i| [0.0, 1.0, 0.5, 0.499, f32::NAN, 2.0, -1.0][i % 7]);
    Selection { confidence: confidence.collect() }
}

#[test]
fn a_selection_survives_and_stays_on_its_side_of_one_half() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("selection.json");
    let notes = SelectionNotes {
        object_box: Some(BoxDocument { min: [0.0; 3], max: [1.0, 2.0, 3.0] }),
        support_plane: Some(PlaneDocument { normal: [0.0, 0.0, 1.0], offset: 0.5 }),
        steps: Vec::new(),
    };
    let document = SelectionDocument::new(&sample(), bound(21), notes.clone());
    write_selection(&path, &document).unwrap();
    let back = read_selection(&path, &bound(21)).unwrap();
    assert_eq!(back.selection.rows(), sample().rows());
    assert_eq!(back.notes, notes);
    assert!(back.warnings.is_empty());
    let sample = sample();
    let worst = sample.confidence.iter().zip(&back.selection.confidence);
    let worst = worst.map(|(a, b)| (a.clamp(0.0, 1.0) - b).abs()).fold(0.0, f32::max);
    assert!(worst <= 0.6 / 255.0, "{worst}");
    // A certain one needs no confidence and gives it back exactly.
    let certain = Selection::where_true(9, |i| i % 2 == 0);
    let document = SelectionDocument::new(&certain, bound(9), SelectionNotes::default());
    assert_eq!(document.confidence, None);
    assert_eq!(document.check(&path, &bound(9)).unwrap().selection, certain);
}

#[test]
fn a_stale_selection_is_an_error_that_names_both_files() {
    let document = SelectionDocument::new(&sample(), bound(21), SelectionNotes::default());
    let other = BoundGaussians {
        sha256: "b".repeat(64),
        count: 21,
        name: "new.ply".into(),
        same_rows_as: None,
    };
    let text = document.check(Path::new("s.json"), &other).unwrap_err().to_string();
    for part in ["stale", "g.ply", "new.ply", "aaaaaaaaaaaa", "bbbbbbbbbbbb", "help:", "s.json"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn a_selection_of_a_file_with_the_same_rows_holds() {
    let document = SelectionDocument::new(&sample(), bound(21), SelectionNotes::default());
    let mut scene = BoundGaussians { sha256: "c".repeat(64), ..bound(21) };
    scene.same_rows_as = Some("a".repeat(64));
    assert_eq!(document.clone().check(Path::new("s.json"), &scene).unwrap().selection.len(), 21);
    scene.same_rows_as = Some("b".repeat(64));
    document.check(Path::new("s.json"), &scene).unwrap_err();
}

#[test]
fn contradictions_are_refused() {
    let good = SelectionDocument::new(&sample(), bound(21), SelectionNotes::default());
    let cause = |change: &dyn Fn(&mut SelectionDocument)| {
        let mut document = good.clone();
        change(&mut document);
        let text = serde_json::to_vec(&document).unwrap();
        let name = Path::new("s.json");
        let parsed = parse_document::<SelectionDocument>(&text, name).unwrap().document;
        parsed.check(name, &bound(21)).unwrap_err().to_string()
    };
    assert!(cause(&|d| d.count += 1).contains("Gaussians belong"));
    assert!(cause(&|d| d.bits = "????".into()).contains("base64"));
    assert!(cause(&|d| d.bits = "AAAA".into()).contains("disagrees"));
    assert!(cause(&|d| d.bits = "AA==".into()).contains("1 bytes where 3"));
    assert!(cause(&|d| d.gaussians.count = 3).contains("stale"));
    let plane = PlaneDocument { normal: [0.0; 3], offset: 0.0 };
    assert!(cause(&|d| d.support_plane = Some(plane)).contains("unit vector"));
    let beyond = |d: &mut SelectionDocument| {
        d.confidence = None;
        d.bits = "AAAg".into();
        d.count = 0;
    };
    assert!(cause(&beyond).contains("beyond the last"));
}

#[test]
fn the_hash_is_that_of_the_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("abc");
    std::fs::write(&path, b"abc").unwrap();
    // FIPS 180-2, appendix B.1.
    let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    assert_eq!(sha256_of_file(&path).unwrap(), expected);
    assert_eq!(sha256_of_bytes(b"abc"), expected);
}
