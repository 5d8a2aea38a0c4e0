:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(planning)).
:- use_module(planner_golog(steps)).

% Two robots watch; Main has one of them, whichever is picked, watch and report, beside a count.

station :-
    load_facts(
        [ kind(t, r1, 'Robot'), kind(t, r2, 'Robot'),
          agent(t, 'Watch'(R1), R1), duration(t, 'Watch'(_), fixed(10)),
          duration(t, 'Count', fixed(5)),
          agent(t, 'Guard'(R2), R2), keeps_robot(t, 'Guard'),
          definition(t, 'Guard'(R3), F3, [call(F3, watch, 'Watch'(R3)), call(F3, report, 'Watch'(R3))]),
          definition(t, 'Main', F4, conc([ pick(F4, pick, R4, 'Robot', call(F4, guard, 'Guard'(R4))),
                                           call(F4, count, 'Count') ])),
          % Share: a robot watches, then stands at the desk, where the clerk is first.
          duration(t, 'Clerk', fixed(30)), claims(t, 'Clerk', desk),
          agent(t, 'Stand'(R5), R5), duration(t, 'Stand'(r1), fixed(5)), duration(t, 'Stand'(r2), fixed(6)),
          claims(t, 'Stand'(_), desk),
          definition(t, 'Share', F6, conc([ call(F6, clerk, 'Clerk'),
                                            pick(F6, pick, R6, 'Robot', [ call(F6, watch, 'Watch'(R6)),
                                                                          call(F6, stand, 'Stand'(R6)) ]) ]))
        ], _).

station_gone :- drop_facts(t, _).

% Revision u: the same programs, but r1 may not watch any more.
station_u :-
    forall(( member(Name/Arity, [kind/3, agent/3, duration/3, keeps_robot/2, definition/4,
                            duration/3, claims/3]), functor(Fact, Name, Arity),
             arg(1, Fact, t), call(kb_facts:Fact) ),
           ( Fact =.. [Name, t|Arguments], Other =.. [Name, u|Arguments], load_facts([Other], _) )),
    load_facts([requires(u, 'Watch', able), requires(u, 'Stand', able), kind(u, r2, able)], _).
station_u_gone :- drop_facts(u, _).

open(Key) :- open_session(request(Key, t, 'Main', 2, 0), _).
plan(Key, Now, Dict) :- look_ahead(ahead(Key, Now, tables([], [], [])), _), search_plan(search(Key, 1000, -1), Dict).
% Events as kind-Id-robot.
shown(Dict, Shown) :-
    findall(K-Id-R, ( get_dict(events, Dict, Events), member([K, Id, Rs|_], Events), robot(Rs, R) ), Shown).

robot([], none).
robot([R], R).

:- begin_tests(sessions, [setup(station), cleanup(station_gone)]).

test('all that may start starts', Started == ['s1/task/guard/watch'-r1, 's1/task/count'-none]) :-
    open(s1), plan(s1, 0, _), next_actions(next(s1, 0), Dict),
    shown(Dict, Shown), findall(Id-R, member(started-Id-R, Shown), Started).
test('nothing starts twice', Events-Running == []-2) :-
    open(s2), plan(s2, 0, _), next_actions(next(s2, 0), _), next_actions(next(s2, 0), Dict),
    _{events: Events, running: Running} :< Dict.
test('an outcome starts what follows it', Started == [started-'s3/task/guard/report'-r1]) :-
    open(s3), plan(s3, 0, _), next_actions(next(s3, 0), _),
    report(done(s3, 10, 's3/task/guard/watch', []), Dict), shown(Dict, Started).
test('after the last outcome all is done', Dones == [false, false, true]) :-
    open(s4), plan(s4, 0, _), next_actions(next(s4, 0), _),
    findall(Done, ( member(Id, ['s4/task/guard/watch', 's4/task/count', 's4/task/guard/report']),
                    report(done(s4, 10, Id, []), Dict), get_dict(done, Dict, Done) ), Dones).
test('an outcome of what is not running is an error', throws(error(existence_error(running_action, x), _))) :-
    open(s5), report(done(s5, 0, x, []), _).
test('a closed session is an error', throws(error(existence_error(session, s6), _))) :-
    open(s6), close_session(s6, _), next_actions(next(s6, 0), _).
test('a plan in the middle tells what is under way', Steps == [['s7/task/count', 20, 20], ['s7/task/guard/report', 20, 30]]) :-
    open(s7), plan(s7, 0, _), next_actions(next(s7, 0), _),
    report(done(s7, 20, 's7/task/guard/watch', []), _),
    plan(s7, 20, Dict), get_dict(steps, Dict, All), findall([Id, From, To], member([From, To, Id|_], All), Steps).

test('under another revision what runs goes on, and who may not go on is told',
     [setup(station_u), cleanup(station_u_gone), true(Found == [['r1/task/guard/watch'], false, 2])]) :-
    open(r1), plan(r1, 0, _), next_actions(next(r1, 0), _),
    rebase(rebased(r1, 5, u, [], true), Dict),
    _{unfit: Unfit, replan: Replan, running: Running, events: []} :< Dict,
    Found = [Unfit, Replan, Running].
test('who may not go on is replaced once the action has ended', [setup(station_u), cleanup(station_u_gone), true(Robot == r2)]) :-
    open(r2), plan(r2, 0, _), next_actions(next(r2, 0), _), rebase(rebased(r2, 5, u, [], true), _),
    release(ended(r2, 10, 'r2/task/guard/watch'), _), plan(r2, 10, _), next_actions(next(r2, 10), Next),
    shown(Next, Events), memberchk(started-'r2/task/guard/watch'-Robot, Events).
test('who waits for its turn when it may not go on any more is replaced at once',
     [setup(station_u), cleanup(station_u_gone), true(Found == [[], true, ['r5/task/watch'-r2]])]) :-
    open_session(request(r5, t, 'Share', 2, 0), _), plan(r5, 0, _), next_actions(next(r5, 0), First),
    shown(First, Began), memberchk(started-'r5/task/watch'-r1, Began),
    report(done(r5, 10, 'r5/task/watch', []), Idle), shown(Idle, []),
    rebase(rebased(r5, 15, u, [], true), Dict), _{unfit: Unfit, replan: Replan} :< Dict,
    plan(r5, 15, _), next_actions(next(r5, 15), Next),
    shown(Next, Events), findall(Id-Robot, member(started-Id-Robot, Events), Started), Found = [Unfit, Replan, Started].
test('under a revision that says the same, the plan stays', Found == [[], false, []]) :-
    open(r3), plan(r3, 0, _), next_actions(next(r3, 0), _),
    rebase(rebased(r3, 5, t, [], false), Dict),
    _{unfit: Unfit, replan: Replan, events: Events} :< Dict,
    Found = [Unfit, Replan, Events].
test('a copy is planned with; the session knows nothing of it', Dones == [false, false, true]) :-
    open(r4), plan(r4, 0, _), next_actions(next(r4, 0), _),
    fork_session(fork(r4, r4_copy, 5, t, []), _), plan(r4_copy, 5, Dict), get_dict(steps, Dict, [_|_]), close_session(r4_copy, _),
    findall(Done, ( member(Id, ['r4/task/guard/watch', 'r4/task/count', 'r4/task/guard/report']),
                    report(done(r4, 10, Id, []), D), get_dict(done, D, Done) ), Dones).

:- end_tests(sessions).
