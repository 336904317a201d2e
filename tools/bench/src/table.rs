//! The record as a table for people.
#![expect(clippy::print_stdout, reason = "the table is what this program is for")]

use crate::Record;

pub(crate) fn print(record: &Record) {
    println!(
        "Floor: the arithmetic of one (pixel, Gaussian) pair, all data in the first-level cache"
    );
    for (name, floor) in &record.floors {
        let (forward, backward) = (floor.forward_ns, floor.backward_ns);
        println!("  {name:<9} forward {forward:.3} ns, backward {backward:.3} ns");
    }
    for row in &record.rows {
        let per = |ms: f64, items: f64| 1e6 * ms / items;
        let floor = record.floors.iter().find(|(name, _)| *name == row.simd).map(|(_, f)| f);
        let ratio = |value: f64, floor: Option<f64>| {
            floor.map_or(String::new(), |floor| format!(" ({:.2}x floor)", value / floor))
        };
        let (forward, backward) = (row.forward_ns_per_pair(), row.backward_ns_per_pair());
        let n = row.gaussians as f64;
        println!("\n{}, {}, {} thread(s)", row.workload, row.simd, row.threads);
        println!(
            "  per view: {:.0} visible, {:.0} tile entries, {:.2} M pairs visited, {:.2} M composited \
             ({:.1} per pixel), visited/composited {:.2}",
            row.visible,
            row.tile_entries,
            row.pairs_visited / 1e6,
            row.pairs_composited / 1e6,
            row.pairs_composited / row.pixels,
            row.pairs_visited / row.pairs_composited
        );
        println!(
            "  forward  {forward:.3} ns per visited pair{}, {:.3} per composited",
            ratio(forward, floor.map(|f| f.forward_ns)),
            per(row.forward_ms, row.pairs_composited)
        );
        println!(
            "  backward {backward:.3} ns per visited pair{}, {:.3} per composited",
            ratio(backward, floor.map(|f| f.backward_ns)),
            per(row.backward_ms, row.pairs_composited)
        );
        println!(
            "  project {:.1} ns per Gaussian; sort and bin {:.1} ns per visible Gaussian, {:.1} per \
             entry; chain to parameters {:.1} ns per Gaussian",
            per(row.project_ms, n),
            per(row.bin_ms, row.visible),
            per(row.bin_ms, row.tile_entries),
            per(row.chain_ms, n)
        );
        println!(
            "  core-ms per view: project {:.2} + bin {:.2} + forward {:.2} = render {:.2}; backward \
             {:.2} + chain {:.2}; all {:.2}",
            row.project_ms,
            row.bin_ms,
            row.forward_ms,
            row.render_ms(),
            row.backward_ms,
            row.chain_ms,
            row.total_ms()
        );
    }
}
