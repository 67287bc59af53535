% Times EIDORS on the cases of forward.py, and compares the voltages.
%
%   octave --quiet benchmarks/eidors/time_eidors.m FOLDER PATH/TO/eidors/startup.m
%
% Processor time, median of nine, EIDORS' cache emptied before each. Not run by tomoskin's authors.

args = argv();
if numel(args) < 2
  error('expected FOLDER and the path of EIDORS'' startup.m');
end
folder = args{1};
run(args{2});
eidors_msg('log_level', 0);
files = dir(fullfile(folder, '*.mat'));
printf('%-20s %10s %12s %12s %8s %12s %12s %8s %10s\n', 'case', 'triangles', 'forward s', ...
       'tomoskin s', 'ratio', 'Jacobian s', 'tomoskin s', 'ratio', 'V apart');

for f = 1:numel(files)
  c = load(fullfile(folder, files(f).name));
  n = numel(c.z_contact);

  stimulation = struct([]);
  drives = unique(c.drive, 'rows', 'stable');
  rows = zeros(0, 1);                       % EIDORS' order, as rows of the case
  for d = 1:size(drives, 1)
    own = find(all(c.drive == drives(d, :), 2));
    current = zeros(n, 1);
    current(drives(d, 1)) = 1;              % current enters at the source
    current(drives(d, 2)) = -1;
    meas = zeros(numel(own), n);
    for k = 1:numel(own)
      meas(k, c.measure(own(k), 1)) = 1;
      meas(k, c.measure(own(k), 2)) = -1;
    end
    stimulation(d).stim_pattern = sparse(current);
    stimulation(d).meas_pattern = sparse(meas);
    rows = [rows; own];
  end

  electrode = struct([]);
  for k = 1:n
    electrode(k).nodes = double(c.electrode_nodes{k}(:)');
    electrode(k).z_contact = c.z_contact(k);
  end

  fmdl = eidors_obj('fwd_model', files(f).name, ...
    'nodes', c.nodes, 'elems', double(c.elems), 'gnd_node', 1, ...
    'boundary', find_boundary(double(c.elems)), ...
    'electrode', electrode, 'stimulation', stimulation, ...
    'solve', @fwd_solve_1st_order, 'jacobian', @jacobian_adjoint, ...
    'system_mat', @system_mat_1st_order, 'normalize_measurements', 0);
  img = mk_image(fmdl, c.sigma);

  repeats = 9;
  forward = zeros(repeats, 1);
  jacobian = zeros(repeats, 1);
  for k = 1:repeats
    eidors_cache('clear_all');
    began = cputime();
    v = fwd_solve(img);
    forward(k) = cputime() - began;
    eidors_cache('clear_all');
    began = cputime();
    J = calc_jacobian(img);
    jacobian(k) = cputime() - began;
  end
  apart = max(abs(v.meas - c.v_tomoskin(rows))) / max(abs(c.v_tomoskin));
  printf('%-20s %10d %12.4f %12.4f %8.1f %12.4f %12.4f %8.1f %10.1e\n', files(f).name, ...
         size(c.elems, 1), median(forward), c.forward_s, median(forward) / c.forward_s, ...
         median(jacobian), c.jacobian_s, median(jacobian) / c.jacobian_s, apart);
end
