"""What the programs of scripts/bench share: one file per concept, standard library only.

declaration  dials/<stage>.json to settings: what to run
captures     inputs to captures, their hashes, variants with few views, references
lab          one run of one setting: inputs, command, scores
runner       one measured process, the cache of finished runs, two side by side, the budget
front        means, spreads, the Pareto front, slopes
record       finished runs to the dated record and its page
plot         the record as SVG
page         numbers of a record between markers of docs/benchmarks/speed-accuracy.md
curves       cost curves: fits, table, picture
synthetic    made-up scenes of any size for cost curves
"""
