use fetiplast::comm::Comm;
fn main() {
    let comm = fetiplast::comm::world::World::start().unwrap();
    let args: Vec<String> = std::env::args().collect();
    let level: usize = args.get(1).map_or(1, |s| s.parse().unwrap());
    let scene = fetiplast::scene::Scene::load(args.get(2).map_or("two-blocks", |s| s), level, &args[3.min(args.len())..]).unwrap();
    let m = fetiplast::monitor::timing::Timer::start();
    let d = fetiplast::study::discretise(&scene, &comm).unwrap();
    let rows = fetiplast::study::count_rows(&d, &comm);
    if comm.rank() == 0 { println!("{:?} {}", rows, d.decomposition.shares.total()); }
    let s = fetiplast::study::solve(&scene, &d, &comm, &m).unwrap();
    if comm.rank() == 0 {
        println!("{:?} J {:.12e} psi {:.9e} work {:.13e} plastic {} {:?}", s.outcome, s.energy, s.internal_energy, s.external_work, s.plastic_elements, s.residuals);
        println!("{:.2} {:#?}", m.total_seconds(), fetiplast::monitor::timing::PhaseTable::gather(&fetiplast::comm::solo::Solo, &m));
    }
}
