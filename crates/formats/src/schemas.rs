//! The documents that several programs share, as a list.

use serde_json::Value;

use crate::documents::schema;
use crate::{
    camera_path, capture, decomposition, labels, metrics, provider, run_record, scene_card,
    selection, statistics, train_report,
};

/// The JSON Schema of every document that several programs share, by the name of its schema file: `NAME-vMAJOR`.
pub fn all_schemas() -> Vec<(String, Value)> {
    vec![
        schema::<capture::CaptureDocument>(),
        schema::<camera_path::CameraPathDocument>(),
        schema::<decomposition::DecompositionDocument>(),
        schema::<labels::LabelsDocument>(),
        schema::<metrics::MetricsDocument>(),
        schema::<provider::ProviderDescription>(),
        schema::<provider::ProviderRequest>(),
        schema::<provider::ProviderReply>(),
        schema::<run_record::RunRecord>(),
        schema::<scene_card::SceneCardDocument>(),
        schema::<selection::SelectionDocument>(),
        schema::<statistics::StatisticsDocument>(),
        schema::<train_report::TrainReportDocument>(),
    ]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn schemas_are_made_for_every_document() {
        let schemas = all_schemas();
        let names: BTreeSet<_> = schemas.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names.len(), schemas.len());
        assert!(names.contains("capture-v1") && names.contains("metrics-v1"));
        for (name, schema) in &schemas {
            assert!(schema["properties"]["format"]["const"].is_string(), "{name}");
            assert_eq!(schema["properties"]["version"]["pattern"], "^1\\.[0-9]+$");
        }
    }
}
