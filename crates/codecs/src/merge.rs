//! Several sets of Gaussians as one.

use motes_scene::{ColumnValues, ExtraColumn, Gaussians};

/// All Gaussians, one set after another, at the highest SH degree of them. Extra columns stay when
/// every set has one of that name and type.
pub fn merge_gaussians(sets: Vec<Gaussians>) -> Gaussians {
    let degree = sets.iter().map(|set| set.sh_degree).max().unwrap_or(0);
    let mut sets = sets.into_iter();
    let Some(mut all) = sets.next() else { return Gaussians::empty(0) };
    if all.sh_degree != degree {
        all = all.with_sh_degree(degree);
    }
    for set in sets {
        let set = if set.sh_degree == degree { set } else { set.with_sh_degree(degree) };
        let partner = |column: &ExtraColumn| {
            let same_type = |other: &&ExtraColumn| {
                std::mem::discriminant(&other.values) == std::mem::discriminant(&column.values)
            };
            set.extra.iter().filter(|other| other.name == column.name).find(same_type)
        };
        all.extra.retain(|column| partner(column).is_some());
        for column in &mut all.extra {
            if let Some(other) = partner(column) {
                append(&mut column.values, &other.values);
            }
        }
        all.means.extend(set.means);
        all.rotations.extend(set.rotations);
        all.log_scales.extend(set.log_scales);
        all.opacity_logits.extend(set.opacity_logits);
        all.sh.extend(set.sh);
    }
    all
}

fn append(to: &mut ColumnValues, from: &ColumnValues) {
    use ColumnValues as V;
    match (to, from) {
        (V::I8(a), V::I8(b)) => a.extend(b),
        (V::U8(a), V::U8(b)) => a.extend(b),
        (V::I16(a), V::I16(b)) => a.extend(b),
        (V::U16(a), V::U16(b)) => a.extend(b),
        (V::I32(a), V::I32(b)) => a.extend(b),
        (V::U32(a), V::U32(b)) => a.extend(b),
        (V::F32(a), V::F32(b)) => a.extend(b),
        (V::F64(a), V::F64(b)) => a.extend(b),
        _ => unreachable!("partners have the same type"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_higher_degree_and_common_columns_stay() {
        let set = |degree: u8, columns: &[&str], x: f32| {
            let extra = columns.iter().map(|name| ExtraColumn {
                name: (*name).into(),
                values: ColumnValues::F32(vec![x]),
            });
            Gaussians {
                means: vec![[x; 3]],
                rotations: vec![[1.0; 4]],
                log_scales: vec![[x; 3]],
                opacity_logits: vec![x],
                sh_degree: degree,
                sh: vec![x; 3 * (usize::from(degree) + 1).pow(2)],
                extra: extra.collect(),
            }
        };
        let all = merge_gaussians(vec![set(0, &["a", "b"], 1.0), set(1, &["b", "c"], 2.0)]);
        assert!(all.is_consistent());
        assert_eq!((all.len(), all.sh_degree, all.extra.len()), (2, 1, 1));
        assert_eq!(all.extra[0].values, ColumnValues::F32(vec![1.0, 2.0]));
        assert_eq!(all.sh_of(0)[..4], [1.0, 1.0, 1.0, 0.0]);
        assert!(merge_gaussians(Vec::new()).is_empty());
    }
}
