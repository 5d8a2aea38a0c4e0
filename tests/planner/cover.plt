:- use_module(library(plunit)).
:- use_module(library(assoc)).
:- use_module(library(aggregate)).
:- use_module(library(random)).
:- use_module(planner_golog(cover)).
:- use_module(planner_golog(travel), [travel/2, travel_time/5]).

% Places a, b, c lie on a line, 1000 ms apart; d can be reached from c alone.

line(Travel) :-
    travel(tables([a, b, c, d],
                  [robot(r1, 1, [0, 1000, 2000, -1]), robot(r2, 1, [2000, 1000, 0, 500])],
                  [[[0, 1000, 2000, -1], [1000, 0, 1000, -1], [2000, 1000, 0, 500], [-1, -1, 500, 0]]]),
           Travel).

network(Nodes, Options, network(side(Nodes), Robots, Team, Travel, [], Exact)) :-
    line(Travel),
    ( memberchk(robots(Robots), Options) -> true ; Robots = [robot(r1, a, none), robot(r2, c, none)] ),
    ( memberchk(team(Team), Options) -> true ; Team = 9 ),
    ( memberchk(exact(Exact), Options) -> true ; Exact = true ).

best(Nodes, Options, Result) :-
    network(Nodes, Options, Network),
    best_cover(Network, 50_000_000, Result).

%   Go to a place and work there for 100 ms: one of the robots, who does nothing else in between.
job(Id, Robots, Goal, alt(Choice, [option(Robots, held(Id, Robot, seq(Steps)))])) :-
    atom_concat(Id, '/robot', Choice),
    ( Robots = [Robot] -> true ; atom_concat(?, Choice, Robot) ),
    steps(Id, Robot, Goal, Steps).

steps(Id, Robot, Goal, [Going, Working]) :-
    Going = step(Go, [Robot], Goal, 1.0, 0, [Goal], []),
    Working = step(Work, [Robot], none, 1.0, 100, [none], []),
    atom_concat(Id, '/go', Go),
    atom_concat(Id, '/work', Work).

think(Id, Ms, step(Id, [], none, 1.0, Ms, [], [])).

who(Steps, Robots) :- findall(Robot, member(step(_, _, _, [Robot]), Steps), All), sort(All, Robots).

:- begin_tests(best_cover).

test('nothing takes no time', R == plan(optimal, 0, 0, [], [], 0)) :- best([], [], R).
test('each robot does what is near', [Makespan, Choices] == [1100, ['1/robot'-r1, '2/robot'-r2]]) :-
    job('1', [r1, r2], b, One), job('2', [r1, r2], c, Two),
    best([One, Two], [], plan(optimal, Makespan, Makespan, Choices, _, _)).
test('steps tell when and by whom', Steps == [step(0, 2000, '1/go', [r1]), step(2000, 2100, '1/work', [r1])]) :-
    job('1', [r1], c, One),
    best([One], [], plan(optimal, 2100, 2100, ['1/robot'-r1], Steps, _)).
test('parts may be nested', Makespan == 1100) :-
    job('1', [r1, r2], b, One), job('2', [r1, r2], c, Two),
    best([seq([side([One, seq([])])]), side([claimed(x, [], seq([seq([]), Two]))])], [],
         plan(optimal, Makespan, Makespan, _, _, _)).
test('a choice that is not the planner\'s has no label', Choices == ['1/robot'-r2]) :-
    job('1', [r1, r2], c, One),
    best([alt(none, [option([1], One)])], [], plan(optimal, 100, 100, Choices, _, _)).
test('a robot need not be held between steps if only the first travels', Makespan == 1200) :-
    steps('1', r1, b, One), steps('2', r1, b, Two),
    best([seq(One), seq(Two)], [], plan(optimal, Makespan, Makespan, [], _, _)).
test('the quicker way is chosen', [Makespan, Choices] == [2100, [way-2]]) :-
    steps('1', r1, d, One), steps('2', r1, c, Two),
    best([alt(way, [option([1], held(x, r1, seq(One))), option([2], held(y, r1, seq(Two)))])], [],
         plan(optimal, Makespan, Makespan, Choices, _, _)).
test('a step that fails half the time travels twice as long; the rest of it is as the network says', Makespan == 4100) :-
    best([step(s, [r1], c, 0.5, 100, [c], [])], [], plan(optimal, Makespan, Makespan, [], _, _)).
test('a way leads over another job', [Makespan, Goals] == [2700, ['1/go', '2/go']]) :-
    job('1', [r1], c, One), job('2', [r1], d, Two),
    best([One, Two], [], plan(optimal, Makespan, Makespan, _, Steps, _)),
    findall(Id, ( member(step(_, _, Id, _), Steps), sub_atom(Id, _, _, 0, '/go') ), Goals).
test('an inexact network has no proven plan', Status == satisficing) :-
    job('1', [r1], c, One),
    best([One], [exact(false)], plan(Status, 2100, 2100, _, _, _)).
test('without time there is a first plan', Result = plan(satisficing, 1100, _, _, _, _)) :-
    job('1', [r1, r2], b, One), job('2', [r1, r2], c, Two),
    network([One, Two], [], Network),
    best_cover(Network, 0, Result).
test('the same again gives the same', One == Two) :-
    findall(Job, ( nth1(I, [a, b, c, b, d], Goal), atom_number(Id, I), job(Id, [r1, r2], Goal, Job) ), Jobs),
    best(Jobs, [], One),
    best(Jobs, [], Two).

:- end_tests(best_cover).

:- begin_tests(limits).

test('a team of one does it all', [Makespan, Robots] == [2200, [r1]]) :-
    job('1', [r1, r2], a, One), job('2', [r1, r2], c, Two),
    best([One, Two], [robots([robot(r1, a, none), robot(r2, b, none)]), team(1)],
         plan(optimal, Makespan, Makespan, _, Steps, _)),
    who(Steps, Robots).
test('a team may be too small for what only some can do', R = none(proven, _)) :-
    job('1', [r1], a, One), job('2', [r2], c, Two),
    best([One, Two], [team(1)], R).
test('no robot is capable', R = none(proven, _)) :-
    job('1', [r1, r2], b, One),
    best([One, alt(c, [])], [], R).
test('there is no way', R = none(proven, _)) :-
    job('1', [r1], d, One),
    best([One], [robots([robot(r1, b, none)])], R).
test('whose battery is too low leaves it to others', Robots == [r2]) :-
    job('1', [r1, r2], b, One),
    best([One], [robots([robot(r1, a, 1099), robot(r2, c, none)])], plan(optimal, 1100, 1100, _, Steps, _)),
    who(Steps, Robots).
test('batteries are too low', R = none(proven, _)) :-
    job('1', [r1], b, One), job('2', [r1], c, Two),
    best([One, Two], [robots([robot(r1, a, 2199)])], R).
test('computations need no battery', Makespan == 6100) :-
    steps('1', r1, b, [Go, Work]), think(t, 5000, Think),
    best([held(x, r1, seq([Go, Think, Work]))], [robots([robot(r1, a, 1100)])],
         plan(optimal, Makespan, Makespan, _, _, _)).
test('with little time nothing is claimed that is not known', R = none(unknown, _)) :-
    job('1', [r1], b, One), job('2', [r1], c, Two),
    network([One, Two], [robots([robot(r1, a, 2199)])], Network),
    best_cover(Network, 1, R).

:- end_tests(limits).

:- begin_tests(begun).

test('what is under way is waited for', [Makespan, Steps] == [700, []]) :-
    best([underway(u, [r1], 700, [b], [])], [], plan(optimal, Makespan, Makespan, [], Steps, _)).
test('a robot goes on from where that ends', [Makespan, Start] == [1800, 700]) :-
    job('1', [r1], c, One),
    best([One, underway(u, [r1], 700, [b], [])], [], plan(optimal, Makespan, Makespan, _, [step(Start, _, _, _)|_], _)).
test('what keeps the robot is done first', [Makespan, Steps] ==
        [1900, [step(700, 800, work, [r1]), step(800, 1800, '1/go', [r1]), step(1800, 1900, '1/work', [r1])]]) :-
    job('1', [r1], c, One),
    Rest = step(work, [r1], none, 1.0, 100, [none], []),
    best([One, held(h, r1, seq([underway(u, [r1], 700, [b], []), Rest]))], [],
         plan(optimal, Makespan, Makespan, _, Steps, _)).
test('both are busy with what they do together', Makespan == 1800) :-
    job('1', [r1, r2], c, One),
    best([One, underway(u, [r1, r2], 700, [b, none], [])], [robots([robot(r1, a, none), robot(r2, b, none)])],
         plan(optimal, Makespan, Makespan, _, _, _)).
test('it does not count against the battery, from which it was taken when it began', [R1, R2] == [[r1], [r2]]) :-
    job('1', [r1, r2], a, One),
    best([One, underway(u, [r1], 100, [a], [])], [robots([robot(r1, a, 100), robot(r2, c, none)])],
         plan(optimal, 200, 200, _, Steps1, _)),
    best([One, underway(u, [r1], 100, [a], [])], [robots([robot(r1, a, 99), robot(r2, c, none)])],
         plan(optimal, 2100, 2100, _, Steps2, _)),
    who(Steps1, R1), who(Steps2, R2).
test('who is at something is in the team', [Makespan, Robots] == [2200, [r1]]) :-
    job('1', [r1, r2], c, One),
    best([One, underway(u, [r1], 100, [none], [])], [team(1)], plan(optimal, Makespan, Makespan, _, Steps, _)),
    who(Steps, Robots).

:- end_tests(begun).

:- begin_tests(without_robots).

test('computations run beside', [Makespan, Steps] ==
        [300, [step(0, 100, s, []), step(0, 200, t, []), step(200, 300, u, [])]]) :-
    think(s, 100, S), think(t, 200, T), think(u, 100, U),
    best([S, seq([T, U])], [], plan(optimal, Makespan, Makespan, [], Steps, _)).
test('the quickest computation is chosen', [Makespan, Choices] == [100, [c-2]]) :-
    think(s, 200, S), think(t, 100, T),
    best([alt(c, [option([1], S), option([2], T)])], [], plan(optimal, Makespan, Makespan, Choices, _, _)).
test('a robot is not sent where it is quicker without', [Makespan, Choices] == [900, [c-1]]) :-
    job('1', [r1], b, One), think(s, 900, S),
    best([alt(c, [option([1], S), option([2], One)])], [], plan(optimal, Makespan, Makespan, Choices, _, _)).
test('a robot is sent where it is quicker', [Makespan, Choices] == [1100, ['1/robot'-r1, c-2]]) :-
    job('1', [r1], b, One), think(s, 1200, S),
    best([alt(c, [option([1], S), option([2], One)])], [], plan(optimal, Makespan, Makespan, Choices, _, _)).

:- end_tests(without_robots).

:- begin_tests(coupled).

coupled(Node) :- best([Node], [], R), R == not_separable.

test('an order to be chosen') :- job('1', [r1], b, One), coupled(any_order(o, [One])).
test('a deadline') :- job('1', [r1], b, One), coupled(by(5000, One)).
test('a claim') :- coupled(step(s, [r1], b, 1.0, 0, [b], [door])).
test('a claim from beginning to end') :- job('1', [r1], b, One), coupled(claimed(x, [door], One)).
test('two robots together') :- coupled(step(s, [r1, r2], b, 1.0, 0, [b, b], [])).
test('one robot after another') :- job('1', [r1], b, One), job('2', [r2], b, Two), coupled(seq([One, Two])).
test('whoever comes first, another one later') :-
    job('1', [r1, r2], b, One), job('2', [r1, r2], b, Two), coupled(seq([One, Two])).
test('a robot may do something else in between') :-
    steps('1', r1, b, One), steps('2', r1, c, Two), append(One, Two, All), coupled(seq(All)).
test('held for what another one does') :- steps('1', r2, b, One), coupled(held(x, r1, seq(One))).
test('what is under way is to be followed by something') :-
    coupled(seq([underway(u, [r1], 100, [b], []), step(s, [r1], none, 1.0, 100, [none], [])])).

:- end_tests(coupled).

% ------------------------------------------------------- random instances, compared with all there is
%
%   A spec is spec(Id, Robots, Ways), Ways a list of way(Goal, Odds, Work_ms, Think_ms, End).

random_case(Seed, Kind, case(Network, Specs, Robots, Begun, Team, Travel)) :-
    set_random(seed(Seed)),
    Places = [p, q, s, t],
    findall(Row, ( member(_, Places), times(Kind, Row) ), Rows0),
    ( Kind == metric -> metric(Rows) ; Rows = Rows0 ),
    findall(robot(Name, 1, Row), ( member(Name, [r1, r2, r3]), times(Kind, Row) ), Profiled0),
    (   Kind == metric
    ->  Profiled = [robot(r1, 1, [1, 4, 7, 9]), robot(r2, 1, [3, 6, 9, 7]), robot(r3, 1, [9, 6, 3, 1])]
    ;   Profiled = Profiled0
    ),
    travel(tables(Places, Profiled, [Rows]), Travel),
    findall(robot(Name, At, Work),
            ( member(Name, [r1, r2, r3]), random_member(At, [here, p, q]), random_member(Work, [none, none, 6, 12]) ),
            Robots),
    findall(begun(Name, Left, End),
            ( member(Name, [r1, r2]), maybe(0.3), random_between(1, 5, Left), random_member(End, [none, s]) ),
            Begun),
    random_member(Team, [1, 2, 3, 3]),
    random_between(2, 4, Size),
    findall(spec(I, Some, Ways), ( between(1, Size, I), random_spec(Kind, Some, Ways) ), Specs),
    findall(Node, ( member(Spec, Specs), spec_node(Spec, Node) ), Nodes),
    findall(underway(u(Name), [Name], Left, [End], []), member(begun(Name, Left, End), Begun), Underway),
    append(Nodes, Underway, All),
    Network = network(side(All), Robots, Team, Travel, [], true).

times(_, Row) :- findall(T, ( between(1, 4, _), ( maybe(0.1) -> T = -1 ; random_between(1, 9, T) ) ), Row).

metric([[0, 3, 6, 8], [3, 0, 3, 5], [6, 3, 0, 2], [8, 5, 2, 0]]).

random_spec(Kind, Robots, Ways) :-
    random_member(Robots, [[r1, r2, r3], [r1, r2], [r2, r3], [r3]]),
    random_member(Many, [1, 1, 2]),
    findall(way(Goal, Odds, Work, Think, End),
            ( between(1, Many, _), random_member(Goal, [p, q, s, t]), random_member(Odds, [1.0, 1.0, 0.5]),
              random_between(1, 3, Work), random_member(Think, [0, 0, 2]),
              ( Kind == odd, maybe(0.4) -> random_member(End, [none, t]) ; End = Goal ) ),
            Ways).

spec_node(spec(I, Robots, Ways), alt(way(I), Options)) :-
    findall(option([K], alt(who(I, K), [option(Robots, held(x, Who, seq([Go, Think, Do])))])),
            ( nth1(K, Ways, way(Goal, Odds, Work, Ms, End)),
              ( Robots = [Who] -> true ; format(atom(Who), '?~w', [who(I, K)]) ),
              Go = step(go(I), [Who], Goal, Odds, 0, [End], []),
              think(think(I), Ms, Think),
              Do = step(do(I), [Who], none, Odds, Work, [none], []) ),
            Options).

%   The least makespan by trying all; none if there is no plan.
least(case(_, Specs, Robots, Begun, Team, Travel), Least) :-
    findall(Most,
            ( maplist(assigned, Specs, Given),
              findall(Name, ( member(_-Name-_, Given) ; member(begun(Name, _, _), Begun) ), Names),
              sort(Names, Used), length(Used, Size),
              findall(N, member(begun(N, _, _), Begun), Already), length(Already, Least_team),
              Size =< max(Team, Least_team),
              findall(End, ( member(Robot, Robots), soonest(Robot, Given, Begun, Travel, End) ), Ends),
              length(Ends, 3),
              max_list(Ends, Most) ),
            All),
    ( min_list(All, Least) -> true ; Least = none ).

assigned(spec(I, Robots, Ways), I-Name-Way) :- member(Name, Robots), member(Way, Ways).

soonest(Robot, Given, Begun, Travel, End) :-
    Robot = robot(Name, _, _),
    findall(I-Way, member(I-Name-Way, Given), Mine),
    aggregate_all(min(Ms), ( permutation(Mine, Order), route(Robot, Order, Begun, Travel, _, Ms) ), End).

%   Times: I-End, when each job ends.
route(robot(Name, Place, Limit), Order, Begun, Travel, Times, End) :-
    (   memberchk(begun(Name, Left, Place1), Begun)
    ->  ( Place1 == none -> At = Place ; At = Place1 )
    ;   Left = 0, At = Place
    ),
    walk(Order, Name, Travel, At, Left, 0, Work, Times, End),  % what is under way was counted when it began
    ( Limit == none -> true ; Order == [] -> true ; Work =< Limit ).

walk([], _, _, _, End, Work, Work, [], End).
walk([I-way(Goal, Odds, Do, Think, Then)|Order], Name, Travel, At, Ms, Work0, Work, [I-Next|Times], End) :-
    travel_time(Travel, Name, At, Goal, Way), !,
    Go is round(Way / Odds),
    Next is Ms + Go + Think + Do,
    Work1 is Work0 + Go + Do,
    ( Then == none -> At1 = At ; At1 = Then ),
    walk(Order, Name, Travel, At1, Next, Work1, Work, Times, End).

%   The plan says what its choices and the order of its steps come to.
tells_the_truth(case(_, Specs, Robots, Begun, _, Travel), Choices, Steps, Makespan) :-
    findall(Start-(I-Name-Way),
            ( member(spec(I, _, Ways), Specs),
              memberchk(way(I)-K, Choices), memberchk(who(I, K)-Name, Choices), nth1(K, Ways, Way),
              memberchk(step(Start, _, go(I), [Name]), Steps) ),
            Begins),
    length(Specs, Size), length(Begins, Size),
    keysort(Begins, Sorted),
    forall(( member(Robot, Robots), Robot = robot(Name, _, _) ),
           ( findall(I-Way, member(_-(I-Name-Way), Sorted), Mine),
             route(Robot, Mine, Begun, Travel, Times, _),
             forall(member(I-End, Times), memberchk(step(_, End, do(I), [Name]), Steps)) )),
    findall(End, ( member(step(_, End, _, _), Steps) ; member(begun(_, End, _), Begun) ), Ends),
    max_list([0|Ends], Makespan).

agrees(Kind, Seed) :-
    random_case(Seed, Kind, Case),
    Case = case(Network, _, _, _, _, _),
    least(Case, Least),
    best_cover(Network, 100_000_000, Result),
    (   Least == none
    ->  Result = none(proven, _)
    ;   Result = plan(optimal, Least, Least, Choices, Steps, _),
        tells_the_truth(Case, Choices, Steps, Least)
    ).

:- begin_tests(all_there_is).

test('where the triangle inequality holds', [forall(between(1, 80, Seed)), nondet]) :- agrees(metric, Seed).
test('where it does not', [forall(between(1, 80, Seed)), nondet]) :- agrees(odd, Seed).

:- end_tests(all_there_is).
