use super::*;

fn sample(label: &str, psnr: f64, lpips: Option<f64>) -> Sample {
    let mut scores = [None; 6];
    (scores[0], scores[3]) = (Some(psnr), lpips);
    Sample { label: label.into(), scores }
}

fn table() -> ScoreTable {
    let samples = [
        sample("ours|a_b", 25.0, Some(0.25)),
        sample("theirs", 26.0, None),
        sample("ours|a_b", 27.0, Some(0.35)),
    ];
    ScoreTable::new(&samples, vec!["PSNR of 8-bit renders.".into()])
}

#[test]
fn a_row_is_mean_and_sample_deviation_of_its_label() {
    let table = table();
    assert_eq!(table.columns, [Column::Psnr, Column::Lpips]);
    assert_eq!(table.rows.iter().map(|row| row.samples).collect::<Vec<_>>(), [2, 1]);
    let ours = table.rows[0].cells[0].unwrap();
    assert!((ours.mean - 26.0).abs() < 1e-12);
    assert!((ours.deviation.unwrap() - 2f64.sqrt()).abs() < 1e-12);
    // Both are 26.00 as printed.
    assert!(ours.is_best && table.rows[1].cells[0].unwrap().is_best);
    assert_eq!(table.rows[1].cells[0].unwrap().deviation, None);
    assert_eq!(table.rows[1].cells[1], None);
}

#[test]
fn less_lpips_is_better_and_a_larger_gap_is_not() {
    let samples = [sample("a", 20.0, Some(0.1)), sample("b", 21.0, Some(0.2))];
    let table = ScoreTable::new(&samples, Vec::new());
    let best = |r: usize, c: usize| table.rows[r].cells[c].unwrap().is_best;
    assert_eq!([best(0, 0), best(1, 0), best(0, 1), best(1, 1)], [false, true, true, false]);
}

#[test]
fn a_score_that_one_sample_lacks_is_no_mean() {
    let samples = [sample("a", 20.0, Some(0.1)), sample("a", 21.0, None)];
    assert_eq!(ScoreTable::new(&samples, Vec::new()).rows[0].cells[1], None);
}

#[test]
fn markdown_escapes_and_shows_the_spread() {
    assert_eq!(
        to_markdown(&table()),
        "| | PSNR (dB) | LPIPS | Runs |\n|---|---:|---:|---:|\n\
         | ours\\|a\\_b | **26.00** ± 1.41 | **0.300** ± 0.071 | 2 |\n\
         | theirs | **26.00** | - | 1 |\n\nPSNR of 8-bit renders.\n"
    );
}

#[test]
fn latex_escapes_and_shows_the_spread() {
    let text = to_latex(&table());
    assert!(text.starts_with("% PSNR of 8-bit renders.\n\\begin{tabular}{lrrr}\n"), "{text}");
    assert!(text.contains("ours|a\\_b & \\textbf{26.00} $\\pm$ 1.41 &"), "{text}");
    assert!(text.contains("theirs & \\textbf{26.00} & -- & 1 \\\\"), "{text}");
}

#[test]
fn csv_has_numbers_in_full_and_starts_no_formula() {
    let samples = [sample("=1+1", 0.1 + 0.2, None), sample("a,\"b\"", 1.0, None)];
    let text = to_csv(&ScoreTable::new(&samples, Vec::new()));
    let lines: Vec<&str> = text.split("\r\n").collect();
    assert_eq!(lines[0], "label,samples,psnr_db,psnr_db_deviation");
    assert_eq!(lines[1], "'=1+1,1,0.30000000000000004,");
    assert_eq!(lines[2], "\"a,\"\"b\"\"\",1,1,");
}
