//! Lists against every pixel, and lanes against one splat.

use super::*;
use crate::lanes::tests::levels;

fn scene() -> Vec<Splat> {
    (0..3000)
        .map(|i| {
            let f = i as f32;
            let center = [(f * 13.7) % 90.0 - 10.0, (f * 7.3) % 70.0 - 10.0];
            let xx = 0.3 + 60.0 * (f * 0.37).sin().abs();
            let (splat, _) = Splat::from_covariance(center, [xx, 0.4, 2.0], 0.5).unwrap();
            Splat {
                depth: 2.0 + ((f * 0.71).sin() * 9.0).round() / 9.0,
                depth_slope: [0.01 * (f * 0.3).sin(), 0.01 * (f * 0.5).cos()],
                ..if i % 7 == 0 { Splat::INVISIBLE } else { splat }
            }
        })
        .collect()
}

#[test]
fn every_touched_tile_lists_the_splat_once_in_depth_order() {
    let splats = scene();
    for (tile, sort) in [(8, Sorting::Global), (16, Sorting::Global), (32, Sorting::Tile)] {
        let parameters =
            RasterParameters { tile_size: tile as u8, sort, ..RasterParameters::default() };
        let mut bins = Bins::default();
        bins.fill(&splats, [70, 50], &parameters);
        assert_eq!(bins.rows.len(), 50usize.div_ceil(tile));
        for (ty, row) in bins.rows.iter().enumerate() {
            for tx in 0..70usize.div_ceil(tile) {
                let center = [(tx as f32 + 0.5) * tile as f32, (ty as f32 + 0.5) * tile as f32];
                let list: Vec<u32> = row.tile(tx).iter().map(|&e| row.ids[e as usize]).collect();
                let key = |id: u32| {
                    let splat = &splats[id as usize];
                    match sort {
                        Sorting::Tile => (splat.depth_at(center[0], center[1]), splat.depth, id),
                        _ => (splat.depth, 0.0, id),
                    }
                };
                assert!(list.windows(2).all(|w| key(w[0]) < key(w[1])), "tile {tx},{ty}");
                for (id, s) in splats.iter().enumerate() {
                    let touched = s.is_visible()
                        && (0..tile * tile).any(|p| {
                            let x = (tx * tile + p % tile) as f32 + 0.5;
                            let y = (ty * tile + p / tile) as f32 + 0.5;
                            s.alpha_at(x, y, 5).is_some()
                        });
                    let listed = list.contains(&(id as u32));
                    assert!(listed || !touched, "tile {tx},{ty} splat {id}");
                }
            }
        }
    }
}

/// Tiles of one splat in the row with top `y0`, from the bands of its rows of blocks.
fn tile_range(splat: &Splat, y0: f32, tile: usize, tiles_x: usize) -> (u32, u32) {
    let (side, per_tile) = (BLOCK as f32, (tile / BLOCK) as f32);
    let (mut first, mut end) = (f32::INFINITY, 0.0f32);
    for k in 0..tile / BLOCK {
        let top = y0 + k as f32 * side + 0.5 - splat.y;
        let Some((left, right)) = splat.band(top, top + side - 1.0) else {
            continue;
        };
        // Columns of blocks before fractions are cut off, as the lanes have them.
        let row_first = ((splat.x + left + 0.5) / side).max(0.0);
        let row_end = ((splat.x + right + side - 0.5) / side).clamp(0.0, tiles_x as f32 * per_tile);
        if row_first <= row_end {
            (first, end) = (first.min(row_first), end.max(row_end));
        }
    }
    let tiles = ((first / per_tile) as u32, ((end + per_tile - 1.0) / per_tile) as u32);
    (tiles.0.min(tiles.1), tiles.1)
}

#[test]
fn ranges_in_lanes_are_those_of_one_splat() {
    let mut splats = scene();
    splats.push(Splat { x: f32::NAN, ..splats[1] });
    splats.push(Splat { x: 3e38, ..splats[2] });
    splats.push(Splat { rightmost_dy: f32::NAN, ..splats[3] });
    let (mut several, mut differ) = (0, 0);
    for level in levels() {
        for (tile, row) in [(8, 3), (16, 0), (32, 1)] {
            let tiles_x = 70usize.div_ceil(tile);
            for splats in splats.chunks(3) {
                let mut tiles = TileRow { splats: splats.to_vec(), ..TileRow::default() };
                dispatch!(level, simd => tiles.find_ranges(simd, row, tile, tiles_x));
                for (got, splat) in tiles.ranges.iter().zip(splats) {
                    let expected = tile_range(splat, (row * tile) as f32, tile, tiles_x);
                    several += usize::from(got.1 > got.0 + 1);
                    // Rounding may decide otherwise within the slack of a bound.
                    differ += usize::from(got.1 - got.0 != expected.1 - expected.0);
                }
            }
        }
    }
    assert!(several > 500 && differ <= 3, "{several} wide, {differ} different");
}

#[test]
fn positions_lead_from_chunks_to_splats() {
    let splats = scene();
    let mut bins = Bins::default();
    bins.fill(&splats, [70, 50], &RasterParameters::default());
    for (r, row) in bins.rows.iter().enumerate() {
        let mut seen = 0;
        for (c, chunk) in bins.chunks.iter().enumerate() {
            let segment = row.segments[c] as usize..row.segments[c + 1] as usize;
            assert_eq!(segment.len(), chunk.row(r).len());
            for (&position, &id) in row.positions[segment].iter().zip(chunk.row(r)) {
                assert_eq!(row.ids[position as usize], id);
                assert_eq!(row.splats[position as usize].x, splats[id as usize].x);
                seen += 1;
            }
        }
        assert_eq!(seen, row.ids.len());
    }
}
