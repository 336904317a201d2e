//! The components of the model: what is in, and by what evidence.

use std::fmt;

use motes_formats::train_report::ComponentCost;
use serde::Serialize;

use crate::{Decision, ProbeCost, Trainer};

/// The part of the report about `--model`.
#[derive(Clone, Debug, Serialize)]
pub struct ModelReport {
    /// Every component, in the order of the decisions.
    pub components: Vec<Decision>,
    /// What each probed component costs a run that has it.
    pub costs: Vec<ComponentCost>,
    /// CPU seconds of every probe; empty after a resume past them.
    pub probes: Vec<ProbeCost>,
    /// Their sum.
    pub probe_cpu_seconds: f64,
    /// Their share of all CPU seconds.
    pub probe_share: Option<f64>,
}

impl ModelReport {
    pub(super) fn new(trainer: &Trainer, cpu_seconds: Option<f64>) -> Self {
        let probes = trainer.probe_costs().to_vec();
        let components = trainer.state.model.decisions.clone();
        // Not `sum`: the sum of no f64 is -0.
        let sum = probes.iter().fold(0.0, |sum, p| sum + p.cpu_seconds);
        let costs = costs(&components, &probes, trainer.plan().iterations);
        let probe_share = cpu_seconds.map(|all| sum / all.max(1e-9));
        Self { components, costs, probes, probe_cpu_seconds: sum, probe_share }
    }
}

fn costs(components: &[Decision], probes: &[ProbeCost], iterations: u32) -> Vec<ComponentCost> {
    let step = |name: &str| {
        let probe = probes.iter().find(|p| p.name == name)?;
        Some(probe.cpu_seconds / f64::from(probe.steps.max(1)))
    };
    let mut out = Vec::new();
    for d in components {
        for c in &d.candidates {
            let name = format!("{} {}", d.component, c.value);
            let without = step(&format!("{} {}", d.component, c.against));
            if let (Some(with), Some(without)) = (step(&name), without) {
                let cpu_seconds = (with - without) * f64::from(iterations);
                let parameters = c.parameters as u64;
                out.push(ComponentCost { name, parameters, cpu_seconds });
            }
        }
    }
    out
}

impl fmt::Display for ModelReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "model (probes {:.1} CPU s, {:.0} % of the run):",
            self.probe_cpu_seconds,
            100.0 * self.probe_share.unwrap_or(0.0)
        )?;
        for d in &self.components {
            write!(f, "\n  {} {} ({}): {}", d.component, d.kept, d.by, d.reason)?;
            for c in &d.candidates {
                write!(
                    f,
                    "\n    {} against {}: held-out {:.2} -> {:.2} dB, evidence {:.0} ± {:.0} nats, \
                     cost {:.0} nats for {} parameters: {}",
                    c.value,
                    c.against,
                    c.psnr_without,
                    c.psnr_with,
                    c.evidence_nats,
                    c.error_nats,
                    c.cost_nats,
                    c.parameters,
                    if c.pays { "pays" } else { "does not pay" }
                )?;
                let name = format!("{} {}", d.component, c.value);
                if let Some(cost) = self.costs.iter().find(|cost| cost.name == name) {
                    // Zero has no sign, though a rounded difference may.
                    let seconds = (10.0 * cost.cpu_seconds).round() / 10.0 + 0.0;
                    write!(f, " ({seconds:+.1} CPU s)")?;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::Candidate;

    use super::*;

    #[test]
    fn a_component_costs_the_difference_of_two_probes() {
        let probe =
            |name: &str, cpu_seconds| ProbeCost { name: name.into(), steps: 10, cpu_seconds };
        let candidate = Candidate {
            value: "3".into(),
            against: "0".into(),
            parameters: 45,
            ..Candidate::default()
        };
        let decision = Decision {
            component: "sh-degree".into(),
            candidates: vec![candidate.clone(), Candidate { value: "2".into(), ..candidate }],
            ..Decision::default()
        };
        let probes = [probe("sh-degree 0", 1.0), probe("sh-degree 3", 1.5)];
        let found = costs(&[decision], &probes, 100);
        assert_eq!(found.len(), 1, "degree 2 was not probed");
        assert!((found[0].cpu_seconds - 5.0).abs() < 1e-9 && found[0].parameters == 45);
    }
}
