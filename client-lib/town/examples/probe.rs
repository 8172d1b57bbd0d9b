fn main() {
    let n = road::Network::parse(&town::default_map().1).unwrap();
    for sp in [1.0, 2.0, 3.0, 5.0, 10.0] {
        let t = std::time::Instant::now();
        let m = road::surface_mesh(&n, sp);
        println!("{sp}: {} tris {} verts {:?}", m.triangles.len(), m.positions.len(), t.elapsed());
    }
    let n = road::Network::parse(
        &std::fs::read_to_string("/work/shared/maps/carla2021-scenic__Town10HD.xodr").unwrap(),
    )
    .unwrap();
    for sp in [1.0, 2.0, 3.0, 5.0, 10.0] {
        let t = std::time::Instant::now();
        let m = road::surface_mesh(&n, sp);
        println!(
            "T10 {sp}: {} tris {} verts {:?}",
            m.triangles.len(),
            m.positions.len(),
            t.elapsed()
        );
    }
}
